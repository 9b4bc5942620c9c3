/** The jobs that match a filter, newest first: pages of the list, kept current by events. Where batches are rows, these stand for their jobs. */
import {signal} from '@preact/signals';
import {getJson} from './api.js';
import {connection, listen} from './store.js';

/** Rows of a page. */
const PAGE = {jobs: 200, batches: 50};
const RELOAD_MS = 1000, POLL_MS = 5000, REFRESH_AT_ONCE = 20;

/** @typedef {Record<string, any>} Job */

export class JobList {
  /** @param {Record<string, string>} filter parameters of GET /v1/jobs @param {boolean} [groups] batches are rows */
  constructor(filter, groups = false) {
    this.filter = groups && !filter.q ? {...filter, batch: 'none'} : filter;  // a name may be that of a job in a batch
    this.groups = groups;
    /** The lists that are read, and those to be read again. */
    this.kinds = /** @type {readonly ('jobs' | 'batches')[]} */ (groups ? ['jobs', 'batches'] : ['jobs']);
    this.stale = new Set(/** @type {('jobs' | 'batches')[]} */ ([]));
    /** Ids of batches and the cursor of their list, and those of the jobs, whose order together is `order`. @type {Record<'jobs' | 'batches', {ids: string[], cursor: string | null}>} */
    this.lists = {jobs: {ids: [], cursor: null}, batches: {ids: [], cursor: null}};
    /** @type {Map<string, Job>} */
    this.jobs = new Map();
    /** @type {string[]} */
    this.order = [];
    /** Changes with every change of the list, at most once in a frame. */
    this.version = signal(0);
    this.loading = signal(true);
    /** @type {import('@preact/signals').Signal<any>} */
    this.problem = signal(null);
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

  /** @param {'jobs' | 'batches'} kind @param {string | null} cursor */
  async page(kind, cursor) {
    const query = new URLSearchParams({...(kind === 'jobs' ? this.filter : {}), limit: String(PAGE[kind]), ...(cursor ? {cursor} : {})});
    const {items, next_cursor} = await getJson(`/v1/${kind}?${query.toString().replaceAll('+', '%20')}`);  // + is no space in the service's queries
    for (const item of items) this.jobs.set(item.id, kind === 'batches' ? {...item, kind: 'batch'} : item);
    return {ids: /** @type {string[]} */ (items.map((/** @type {Job} */ item) => item.id)), cursor: /** @type {string | null} */ (next_cursor)};
  }

  /** Both lists by age: ids begin with the time. What is older than the last one that is known of a list may be missing, and waits for it. */
  merge() {
    const {jobs, batches} = this.lists, {state, q = ''} = this.filter;
    const fits = (/** @type {Job | undefined} */ batch) => batch && (!state || batch.jobs[state] > 0) && (batch.name || '').toLowerCase().includes(q.toLowerCase());
    const shown = batches.ids.filter((id) => fits(this.jobs.get(id)));
    const oldest = [jobs, batches].map(({ids, cursor}) => cursor && ids.at(-1) || '').reduce((a, b) => a > b ? a : b);
    this.order = this.groups ? [...jobs.ids, ...shown].filter((id) => id >= oldest).sort((a, b) => a < b ? 1 : -1) : jobs.ids;
  }

  /** @param {readonly ('jobs' | 'batches')[]} kinds */
  scheduleReload(kinds = this.kinds) {
    for (const kind of kinds) this.stale.add(kind);
    if (this.reloadTimer || this.closed) return;
    const wait = Math.max(0, this.reloadedAt + RELOAD_MS - performance.now());
    this.reloadTimer = window.setTimeout(() => { this.reloadTimer = 0; this.reload([...this.stale]); }, wait);
  }

  /** Reads the first page again; what is further down stays if the page joins it. @param {readonly ('jobs' | 'batches')[]} kinds */
  async reload(kinds = this.kinds) {
    this.reloadedAt = performance.now();
    this.stale.clear();
    try {
      const pages = await Promise.all(kinds.map((kind) => this.page(kind, null)));
      if (this.closed) return;
      pages.forEach(({ids, cursor}, i) => {
        const list = this.lists[kinds[i]], join = ids.length < PAGE[kinds[i]] ? -1 : list.ids.indexOf(/** @type {string} */ (ids.at(-1)));
        const rest = join < 0 ? [] : list.ids.slice(join + 1);
        if (join < 0) list.cursor = cursor;
        list.ids = [...ids, ...rest];
      });
      this.merge();
      this.dropOthers();
      this.problem.value = null;
    } catch (error) {
      this.problem.value = error;
    }
    this.loading.value = false;
    this.changed();
  }

  dropOthers() {
    const {jobs, batches} = this.lists, shown = new Set([...jobs.ids, ...batches.ids]);
    if (this.jobs.size <= 2 * shown.size + PAGE.jobs) return;
    for (const id of this.jobs.keys()) if (!shown.has(id)) this.jobs.delete(id);
  }

  /** Reads the next page, of the list that is known less far. */
  async more() {
    const {jobs, batches} = this.lists, kind = !jobs.cursor || (batches.cursor && (batches.ids.at(-1) || '') > (jobs.ids.at(-1) || '')) ? 'batches' : 'jobs';
    const list = this.lists[kind];
    if (!list.cursor || this.reading) return;
    this.reading = true;
    try {
      const {ids, cursor} = await this.page(kind, list.cursor), known = new Set(list.ids);
      list.ids.push(...ids.filter((id) => !known.has(id)));
      list.cursor = cursor;
      this.merge();
    } catch (error) {
      this.problem.value = error;
    }
    this.reading = false;
    this.changed();
  }

  /** @param {import('./event-stream.js').JobEvent} event */
  event(event) {
    if (this.filter.batch === 'none' && event.batch) return this.scheduleReload(['batches']);
    if (this.filter.batch && !this.groups && event.batch !== this.filter.batch) return;
    const job = this.jobs.get(event.id);
    if (!job || (this.filter.state && event.type !== 'progress' && event.state !== this.filter.state)) {
      if (event.type !== 'progress') this.scheduleReload();
      return;
    }
    if (event.state === 'removed') {
      this.jobs.delete(event.id);
      this.lists.jobs.ids = this.lists.jobs.ids.filter((id) => id !== event.id);
      this.merge();
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
