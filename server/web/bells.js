/** Jobs whose end is announced, once in a browser: kept by the program that has the stream. */

/** @typedef {import('./event-stream.js').JobEvent} JobEvent */
/** @typedef {{id: string, kind: string, name: string, state: string}} Ended */

export class Bells {
  /** @param {(job: Ended) => void} ring @param {(ids: string[]) => void} changed */
  constructor(ring, changed) {
    this.ring = ring;
    this.changed = changed;
    /** @type {Set<string>} */
    this.ids = new Set();
  }

  /** @param {string[]} ids @param {boolean} on */
  set(ids, on) {
    for (const id of ids) on ? this.ids.add(id) : this.ids.delete(id);
    this.changed([...this.ids]);
  }

  /** @param {JobEvent} event */
  event({type, id, state, kind = 'render', name = ''}) {
    if (!this.ids.has(id) || (type !== 'done' && state !== 'removed')) return;
    this.set([id], false);
    if (type === 'done') this.ring({id, kind, name, state});
  }

  /** Looks for jobs that ended while there was no stream. @param {Record<string, string>} headers */
  async check(headers) {
    for (const id of [...this.ids]) {
      const reply = await fetch(`/v1/jobs/${id}`, {headers, cache: 'no-store'}).catch(() => null);
      if (reply?.status === 404) this.set([id], false);
      if (!reply?.ok) continue;
      const job = await reply.json();
      if (['succeeded', 'failed', 'cancelled'].includes(job.state)) this.event({...job, type: 'done'});
    }
  }
}
