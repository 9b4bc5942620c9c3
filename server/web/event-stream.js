/** The stream of all events and the figures of the queue. Runs in the shared worker, or in a tab where there is none. */

const SILENCE_MS = 40_000, RETRY_MS = 1000, POLL_MS = 5000, FIGURES_MS = 1000, FIGURES_IDLE_MS = 15_000, HEALTH_MS = 5000;

/** @typedef {'connecting' | 'live' | 'polling' | 'lost' | 'locked'} State */
/** @typedef {{type: string, id: string, state: string, progress: number, at: string, kind?: string, name?: string, batch?: string | null}} JobEvent */
/** @typedef {{type: 'state', state: State} | {type: 'event', event: JobEvent} | {type: 'queue', queue: any} | {type: 'health', health: import('./service-state.js').Health} | {type: 'reload'}} Message */

export class EventStream {
  /** @param {(message: Message) => void} send */
  constructor(send) {
    this.send = send;
    this.key = '';
    this.lastId = '';
    this.wasLive = false;
    this.figuresAt = 0;
    this.figuresTimer = 0;
    /** @type {AbortController | null} */
    this.running = null;
  }

  /** Starts, or starts again with another key. @param {string} key */
  start(key) {
    this.stop();
    this.key = key;
    const controller = this.running = new AbortController();
    this.run(controller.signal);
    this.idle = setInterval(() => this.readFigures(), FIGURES_IDLE_MS);
    this.healthTimer = setInterval(() => this.readHealth(), HEALTH_MS);
    this.readHealth();
  }

  stop() {
    this.running?.abort();
    this.running = null;
    clearInterval(this.idle);
    clearInterval(this.healthTimer);
    clearTimeout(this.figuresTimer);
    this.figuresTimer = 0;
  }

  /** @returns {Record<string, string>} */
  headers() { return this.key ? {Authorization: `Bearer ${this.key}`} : {}; }

  /** @param {AbortSignal} signal */
  async run(signal) {
    while (!signal.aborted) {
      const status = await this.connect(signal);
      if (signal.aborted) return;
      if (status === 401 || status === 403) {
        this.send({type: 'state', state: 'locked'});
        return;
      }
      const refused = status >= 500;
      this.send({type: 'state', state: refused ? 'polling' : 'lost'});
      if (refused) {
        await this.readFigures();
        this.send({type: 'reload'});
      }
      await new Promise((resolve) => setTimeout(resolve, refused ? POLL_MS : RETRY_MS));
    }
  }

  /** Reads one connection to its end. @param {AbortSignal} signal @returns {Promise<number>} the status; 0: no reply, or the end */
  async connect(signal) {
    const silence = new AbortController();
    const end = () => silence.abort();
    signal.addEventListener('abort', end);
    let timer = setTimeout(end, SILENCE_MS);
    try {
      const headers = this.lastId ? {...this.headers(), 'Last-Event-ID': this.lastId} : this.headers();
      const reply = await fetch('/v1/events', {headers, signal: silence.signal, cache: 'no-store'});
      if (!reply.ok || !reply.body) return reply.status;
      this.send({type: 'state', state: 'live'});
      if (this.wasLive && !this.lastId) this.send({type: 'reload'});  // events between are lost
      this.readFigures();
      if (this.wasLive) this.readHealth();
      this.wasLive = true;
      const reader = reply.body.pipeThrough(new TextDecoderStream()).getReader();
      for (let rest = ''; ;) {
        const {done, value} = await reader.read();
        if (done) return 0;
        clearTimeout(timer);
        timer = setTimeout(end, SILENCE_MS);
        rest = this.take(rest + value);
      }
    } catch {
      return 0;
    } finally {
      clearTimeout(timer);
      signal.removeEventListener('abort', end);
    }
  }

  /** Sends the complete events of `text` and returns what follows them. @param {string} text */
  take(text) {
    const blocks = text.split('\n\n');
    const rest = blocks.pop() || '';
    for (const block of blocks) {
      /** @type {Record<string, string>} */
      const fields = {};
      for (const line of block.split('\n')) {
        const colon = line.indexOf(':');
        if (colon > 0) fields[line.slice(0, colon)] = line.slice(colon + 1).trimStart();
      }
      if (fields.id) this.lastId = fields.id;
      if (fields.event === 'reset') this.send({type: 'reload'});
      else if (fields.data) this.send({type: 'event', event: {type: fields.event, ...JSON.parse(fields.data)}});
      if (fields.event !== 'progress' && fields.data) this.scheduleFigures();
    }
    return rest;
  }

  /** The figures follow changes, at most once a second. */
  scheduleFigures() {
    if (this.figuresTimer) return;
    const wait = Math.max(0, this.figuresAt + FIGURES_MS - Date.now());
    this.figuresTimer = /** @type {any} */ (setTimeout(() => { this.figuresTimer = 0; this.readFigures(); }, wait));
  }

  async readHealth() {
    try {
      const reply = await fetch('/v1/status?history=false', {headers: this.headers(), signal: this.running?.signal, cache: 'no-store'});
      const body = await reply.json();
      if (reply.ok) this.send({type: 'health', health: {ready: body.ready, reason: body.reason, draining: body.draining, disk: body.disk, limits: body.limits}});
      else if (String(body.type).endsWith(':store_unavailable')) {
        this.send({type: 'health', health: {ready: false, reason: 'store:', draining: false, disk: {free_bytes: 0, reserve_bytes: 0}, limits: {queued_jobs: Infinity}}});
      }
    } catch {
      // The stream reports that the service is gone.
    }
  }

  async readFigures() {
    this.figuresAt = Date.now();
    try {
      const reply = await fetch('/v1/queue', {headers: this.headers(), signal: this.running?.signal, cache: 'no-store'});
      if (reply.ok) this.send({type: 'queue', queue: await reply.json()});
    } catch {
      // The stream reports that the service is gone.
    }
  }
}
