/** Jobs and batches whose end is announced, once in a browser: kept by the program that has the stream. */

const BATCH_MS = 500;

/** @typedef {import('./event-stream.js').JobEvent} JobEvent */
/** @typedef {{id: string, kind: string, name: string, state: string}} Ended */

export class Bells {
  /** @param {(ended: Ended) => void} ring @param {(ids: string[]) => void} changed @param {() => Record<string, string>} headers of requests */
  constructor(ring, changed, headers) {
    this.ring = ring;
    this.changed = changed;
    this.headers = headers;
    /** Identifiers of jobs, and "batch/" with those of batches. @type {Set<string>} */
    this.ids = new Set();
    /** Batches that are read soon. @type {Set<string>} */
    this.soon = new Set();
  }

  /** @param {string[]} ids @param {boolean} on */
  set(ids, on) {
    for (const id of ids) on ? this.ids.add(id) : this.ids.delete(id);
    this.changed([...this.ids]);
  }

  /** @param {JobEvent} event */
  event({type, id, state, kind = 'render', name = '', batch}) {
    if (type !== 'done' && state !== 'removed') return;
    if (batch && this.ids.has(`batch/${batch}`)) this.checkSoon(`batch/${batch}`);
    if (!this.ids.has(id)) return;
    this.set([id], false);
    if (type === 'done') this.ring({id, kind, name, state});
  }

  /** Reads a batch, at most twice a second. @param {string} bell */
  checkSoon(bell) {
    if (this.soon.has(bell)) return;
    this.soon.add(bell);
    setTimeout(() => { this.soon.delete(bell); this.checkOne(bell); }, BATCH_MS);
  }

  /** Looks for what ended while there was no stream. */
  async check() {
    for (const bell of [...this.ids]) await this.checkOne(bell);
  }

  /** @param {string} bell */
  async checkOne(bell) {
    const [id, isBatch] = bell.startsWith('batch/') ? [bell.slice(6), true] : [bell, false];
    const reply = await fetch(`/v1/${isBatch ? 'batches' : 'jobs'}/${id}`, {headers: this.headers(), cache: 'no-store'}).catch(() => null);
    if (reply?.status === 404) this.set([bell], false);
    if (!reply?.ok) return;
    const {kind = 'batch', name, state} = await reply.json();
    if (!this.ids.has(bell) || !['succeeded', 'failed', 'cancelled'].includes(state)) return;
    this.set([bell], false);
    this.ring({id, kind, name, state});
  }
}
