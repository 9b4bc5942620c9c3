/** The jobs that match a filter, newest first: pages of the list, kept current by events. */
import {signal} from '@preact/signals';
import {getJson} from './api.js';
import {connection, listen} from './store.js';

const PAGE = 200, RELOAD_MS = 1000, POLL_MS = 5000, REFRESH_AT_ONCE = 20;

/** @typedef {Record<string, any>} Job */

export class JobList {
  /** @param {Record<string, string>} filter parameters of GET /v1/jobs */
  constructor(filter) {
    this.filter = filter;
    /** @type {Map<string, Job>} */
    this.jobs = new Map();
    /** @type {string[]} */
    this.order = [];
    /** Changes with every change of the list, at most once in a frame. */
    this.version = signal(0);
    this.loading = signal(true);
    /** @type {import('@preact/signals').Signal<any>} */
    this.problem = signal(null);
    /** @type {string | null} */
    this.cursor = null;
    this.frame = 0;
    this.reloadTimer = 0;
    this.reloadedAt = 0;
    /** Ids of jobs that ended, to be read again for their reports. @type {Set<string>} */
    this.ended = new Set();
    this.closed = false;
    this.stop = listen({event: (event) => this.event(event), reload: () => this.scheduleReload()});
    this.poll = setInterval(() => { if (connection.value === 'polling') this.scheduleReload(); }, POLL_MS);
    this.reload();
  }

  close() {
    this.closed = true;
    this.stop();
    clearInterval(this.poll);
    clearTimeout(this.reloadTimer);
    cancelAnimationFrame(this.frame);
  }

  changed() {
    if (this.frame || this.closed) return;
    this.frame = requestAnimationFrame(() => { this.frame = 0; ++this.version.value; });
  }

  /** @param {string | null} cursor */
  async page(cursor) {
    const query = new URLSearchParams({...this.filter, limit: String(PAGE), ...(cursor ? {cursor} : {})});
    return getJson(`/v1/jobs?${query.toString().replaceAll('+', '%20')}`);  // + is no space in the service's queries
  }

  scheduleReload() {
    if (this.reloadTimer || this.closed) return;
    const wait = Math.max(0, this.reloadedAt + RELOAD_MS - performance.now());
    this.reloadTimer = window.setTimeout(() => { this.reloadTimer = 0; this.reload(); }, wait);
  }

  /** Reads the first page again; what is further down stays if the page joins it. */
  async reload() {
    this.reloadedAt = performance.now();
    try {
      const {items, next_cursor} = await this.page(null);
      if (this.closed) return;
      const first = items.map((/** @type {Job} */ job) => job.id);
      const join = first.length < PAGE ? -1 : this.order.indexOf(first.at(-1));
      const rest = join < 0 ? [] : this.order.slice(join + 1);
      if (join < 0) this.cursor = next_cursor;
      this.order = [...first, ...rest];
      for (const job of items) this.jobs.set(job.id, job);
      if (this.jobs.size > 2 * this.order.length + PAGE) this.dropOthers();
      this.problem.value = null;
    } catch (error) {
      this.problem.value = error;
    }
    this.loading.value = false;
    this.changed();
  }

  dropOthers() {
    const shown = new Set(this.order);
    for (const id of this.jobs.keys()) if (!shown.has(id)) this.jobs.delete(id);
  }

  /** Reads the next page. */
  async more() {
    if (!this.cursor || this.reading) return;
    this.reading = true;
    try {
      const {items, next_cursor} = await this.page(this.cursor);
      const known = new Set(this.order);
      this.order.push(...items.map((/** @type {Job} */ job) => job.id).filter((/** @type {string} */ id) => !known.has(id)));
      for (const job of items) this.jobs.set(job.id, job);
      this.cursor = next_cursor;
    } catch (error) {
      this.problem.value = error;
    }
    this.reading = false;
    this.changed();
  }

  /** @param {import('./event-stream.js').JobEvent} event */
  event(event) {
    if (this.filter.batch && event.batch !== this.filter.batch) return;
    const job = this.jobs.get(event.id);
    if (!job || (this.filter.state && event.type !== 'progress' && event.state !== this.filter.state)) {
      if (event.type !== 'progress') this.scheduleReload();
      return;
    }
    if (event.state === 'removed') {
      this.jobs.delete(event.id);
      this.order = this.order.filter((id) => id !== event.id);
    } else {
      this.jobs.set(event.id, {...job, state: event.state, progress: event.progress});
      if (event.type === 'done') this.ended.add(event.id);
    }
    this.changed();
  }

  /** Reads the jobs among `ids` that ended since they were read. @param {string[]} ids those in view */
  async refresh(ids) {
    const wanted = ids.filter((id) => this.ended.has(id)).slice(0, REFRESH_AT_ONCE);
    for (const id of wanted) this.ended.delete(id);
    await Promise.all(wanted.map(async (id) => {
      const job = await getJson(`/v1/jobs/${id}`).catch(() => null);
      if (job) this.jobs.set(id, job);
    }));
    if (wanted.length > 0) this.changed();
  }
}
