/** Live drafts: each change of the text is checked, then rendered small and quickly; when typing stops, with the settings of the document. */
import {batch, signal} from '@preact/signals';
import {getJson, mayWrite, postJson, Problem, request} from './api.js';

const TYPING_PAUSE_MS = 150, REFINE_AFTER_MS = 600, POLL_MS = 500;
const HISTORY_MAX = 24;
const DRAFT_SIDE = 320, DRAFT_BUDGET_MS = 100, DRAG_BUDGET_MS = 40, PREVIEW_SIDE = 1024;
const DRAG_IN_FLIGHT_MAX = 2;
/** A busy machine traces a few samples within the budget, and the image is made of blocks. Later than this, fewer pixels have one sample each. */
const DRAG_LATE_MS = 120, LATE_SIDE = 160;
/** Above these a draft is made on request only. */
const AUTO_BYTES_MAX = 1_000_000, AUTO_SECONDS_MAX = 2;

/** @typedef {import('./api.js').Issue} Issue */
/**
 * @typedef {object} Shown an image and what is known of it
 * @property {string} url of a blob
 * @property {string} [under] url of the image before, while this one has parts that are not rendered yet
 * @property {'draft' | 'refining' | 'refined'} kind
 * @property {number} width of the render
 * @property {number} height
 * @property {number} milliseconds from the request to the image
 * @property {string} text the document
 * @property {any} [error] report.error of the job
 * @property {string} [job] id
 */
/** @typedef {{valid: boolean, errors: Issue[], warnings: Issue[], requirements: any, reasons: any, global_light: string | null, estimate: any}} Validation */

/**
 * The document of a draft: small, quick, not kept.
 * @param {any} scene @param {number | null} budgetMs null: one sample for each pixel @param {{width: number, height: number}} size of documents that name none @param {number} [side] the longer one
 */
export function draftOf(scene, budgetMs, size, side = DRAFT_SIDE) {
  const width = scene.image?.width ?? size.width, height = scene.image?.height ?? size.height;
  const scale = Math.min(1, side / Math.max(width, height));
  const {model, approximate, max_depth, cutoff} = scene.accuracy || {};
  const {exposure, overflow, palette} = scene.output || {};
  return {
    ...scene,
    image: {width: Math.max(1, Math.round(width * scale)), height: Math.max(1, Math.round(height * scale))},
    accuracy: {model, ...(budgetMs === null ? {samples: [1, 1]} : {time_budget_ms: budgetMs}), approximate, max_depth, cutoff},
    output: {formats: ['png'], exposure, overflow, palette},
    job: {keep: false, priority: 100, cache: 'off'},
  };
}

export class Drafts {
  /** @param {{size: {width: number, height: number}, onValidated: (text: string, result: Validation) => void}} options the size of documents that name none */
  constructor({size, onValidated}) {
    /** Images of earlier texts, newest last. @type {import('@preact/signals').Signal<Shown[]>} */
    this.history = signal([]);
    /** The one of them that the user looks at. @type {import('@preact/signals').Signal<Shown | null>} */
    this.older = signal(null);
    this.size = size;
    this.onValidated = onValidated;
    /** @type {import('@preact/signals').Signal<Shown | null>} */
    this.shown = signal(null);
    /** @type {import('@preact/signals').Signal<Validation | null>} */
    this.validation = signal(null);
    /** @type {import('@preact/signals').Signal<Problem | null>} */
    this.problem = signal(null);
    this.busy = signal(false);
    this.auto = signal(true);
    this.refine = signal(true);
    /** Why drafts are made on request only: '', 'size', 'time'. */
    this.manualReason = signal('');
    this.text = '';
    /** Number of the latest text; answers for earlier ones are dropped. */
    this.latest = 0;
    this.shownNumber = 0;
    this.timer = 0;
    /** @type {AbortController | null} */
    this.inFlight = null;
    /** @type {string | null} */
    this.refining = null;
    this.followed = new AbortController();  // ends the requests about it
    this.dragging = false;
    /** The live view shows drags. */
    this.isLive = false;
    this.inDrag = 0;
    this.isLate = false;  // a draft of this drag came late
    this.waiting = false;
    this.closed = false;
  }

  /** The user changed the text. @param {string} text */
  edited(text) {
    this.record();
    this.older.value = null;
    this.text = text;
    ++this.latest;
    clearTimeout(this.timer);
    this.stopRefining();
    if (this.dragging) {
      this.drag();
      return;
    }
    this.inFlight?.abort();  // its answer would be stale
    if (!this.isLarge()) this.timer = window.setTimeout(() => this.run(), TYPING_PAUSE_MS);
  }

  /** Renders a draft now, whatever the switches are. */
  now() {
    clearTimeout(this.timer);
    this.run(true);
  }

  /** Switches drafts of texts as they change on or off. @param {boolean} on */
  setAuto(on) {
    this.auto.value = on;
    if (!on || this.isLarge()) return;
    clearTimeout(this.timer);
    this.stopRefining();
    this.inFlight?.abort();
    this.run();
  }

  /** A large text is not even checked before the user requests a draft. */
  isLarge() {
    const isLarge = this.text.length > AUTO_BYTES_MAX;
    if (isLarge || this.manualReason.value === 'size') this.manualReason.value = isLarge ? 'size' : '';
    return isLarge;
  }

  /** @param {boolean} [requested] by the user */
  async run(requested = false) {
    const number = this.latest, text = this.text;
    if (!mayWrite.value || !this.isJson(text)) return;  // a key that may only read renders nothing
    const controller = this.inFlight = new AbortController();
    this.busy.value = true;
    try {
      const validation = await postJson('/v1/jobs/validate', text, {signal: controller.signal});
      if (number !== this.latest || this.closed) return;
      this.validation.value = validation;
      this.onValidated(text, validation);
      if (!validation.valid) return;
      if (!requested && (await this.tooSlow(text, validation, controller.signal) || !this.auto.value)) return;
      await this.draft(number, text, DRAFT_BUDGET_MS, controller.signal);
      if (number === this.latest && this.refine.value) this.timer = window.setTimeout(() => this.startRefining(number), REFINE_AFTER_MS);
    } catch (error) {
      this.failed(error, number);
    } finally {
      if (this.inFlight === controller) {
        this.inFlight = null;
        this.busy.value = false;
      }
    }
  }

  /** Text that is no JSON is not sent; the editor marks the place. @param {string} text */
  isJson(text) {
    try {
      JSON.parse(text);
      return true;
    } catch (error) {
      const issue = {pointer: '', code: 'not_json', detail: /** @type {Error} */ (error).message};
      this.validation.value = {valid: false, errors: [issue], warnings: [], requirements: null, reasons: null, global_light: null, estimate: null};
      return false;
    }
  }

  /** True if one sample per pixel of the draft takes long; a draft takes no less. @param {string} text @param {Validation} validation @param {AbortSignal} signal */
  async tooSlow(text, validation, signal) {
    let seconds = validation.estimate.seconds;
    if (seconds > AUTO_SECONDS_MAX) {
      const {accuracy, ...draft} = draftOf(JSON.parse(text), DRAFT_BUDGET_MS, this.size);
      const {time_budget_ms: _, ...others} = accuracy;
      seconds = (await postJson('/v1/jobs/validate', {...draft, accuracy: {...others, samples: [1, 1]}}, {signal})).estimate.seconds;
    }
    this.manualReason.value = seconds > AUTO_SECONDS_MAX ? 'time' : '';
    return this.manualReason.value !== '';
  }

  /** @param {number} number @param {string} text @param {number} budgetMs @param {AbortSignal} [signal] */
  async draft(number, text, budgetMs, signal) {
    const document = this.dragging && this.isLate ? draftOf(JSON.parse(text), null, this.size, LATE_SIDE) : draftOf(JSON.parse(text), budgetMs, this.size);
    const begin = performance.now();
    const reply = await request('POST', '/v1/render', {json: document, headers: {Accept: 'image/png'}, signal});
    const bytes = await reply.blob();
    const milliseconds = performance.now() - begin;
    this.isLate ||= this.dragging && milliseconds > DRAG_LATE_MS;
    if (this.closed || number < this.shownNumber || (!this.dragging && number !== this.latest)) return;
    const job = reply.headers.get('Content-Location')?.split('/')[3];
    this.show(number, {kind: 'draft', url: URL.createObjectURL(bytes), ...document.image, milliseconds, text, job});
    if (job && !this.dragging) this.addError(number, job);
  }

  /** The error that the render reports, for the caption. @param {number} number @param {string} id */
  async addError(number, id) {
    const job = await getJson(`/v1/jobs/${id}`).catch(() => null);
    const shown = this.shown.value;
    if (job?.report && shown?.job === id && number === this.shownNumber) this.shown.value = {...shown, error: job.report.error};
  }

  /** @param {number} number @param {Shown} image */
  show(number, image) {
    const before = this.shown.value, under = before?.under || before?.url;
    this.shownNumber = number;
    batch(() => {
      this.shown.value = image.kind === 'refining' ? {...image, under} : image;
      this.problem.value = null;
    });
    for (const url of [before?.url, before?.under]) {
      if (url && url !== this.shown.value?.under && !this.history.value.some((each) => each.url === url)) URL.revokeObjectURL(url);
    }
  }

  /** Keeps the image of the text that the user leaves. */
  record() {
    const shown = this.shown.value, history = this.history.value;
    if (!shown || this.dragging || shown.kind === 'refining' || shown.text !== this.text || history.includes(shown)) return;
    for (const old of history.slice(0, -HISTORY_MAX + 1)) URL.revokeObjectURL(old.url);
    this.history.value = [...history.slice(-HISTORY_MAX + 1), shown];
  }

  // ---- dragging in the image: two drafts in flight, so that the service reads one while it traces the other, and one waiting

  beginDrag() {
    this.dragging = true;
    this.isLate = false;
    clearTimeout(this.timer);
    this.stopRefining();
    this.inFlight?.abort();
    this.inFlight = null;
  }

  async drag() {
    if (this.isLive) return;
    this.waiting = true;
    if (this.inDrag === DRAG_IN_FLIGHT_MAX) return;
    ++this.inDrag;
    while (this.waiting && this.dragging) {
      this.waiting = false;
      await this.draft(this.latest, this.text, DRAG_BUDGET_MS).catch((error) => this.failed(error, this.latest));
    }
    --this.inDrag;
  }

  endDrag() {
    this.dragging = false;
    if (!this.isLarge()) this.run();
  }

  // ---- refining: the document as it is

  /** @param {number} number */
  async startRefining(number) {
    if (number !== this.latest || this.closed) return;
    const text = this.text, scene = JSON.parse(text);
    const begin = performance.now();
    try {
      const formats = (scene.output?.formats || ['png']).includes('png') ? scene.output?.formats : ['png', ...scene.output.formats];
      const job = await postJson('/v1/jobs', {...scene, output: {...scene.output, formats}, job: {keep: false, priority: 60, cache: 'off'}});
      if (number !== this.latest || this.closed) {
        cancel(job.id);
        return;
      }
      this.refining = job.id;
      await this.follow(number, text, job.id, begin, this.followed.signal);
    } catch (error) {
      this.failed(error, number);
    } finally {
      if (number === this.latest) this.refining = null;
    }
  }

  /** @param {number} number @param {string} text @param {string} id @param {number} begin @param {AbortSignal} signal */
  async follow(number, text, id, begin, signal) {
    for (;;) {
      const job = await getJson(`/v1/jobs/${id}?wait=1`, {signal});
      if (number !== this.latest || this.closed) return;
      if (job.state === 'failed') throw new Problem(500, {detail: job.problem?.detail});
      const ended = job.state === 'succeeded';
      const reply = ended ? await request('GET', `/v1/jobs/${id}/image.png`, {signal})
        : await request('GET', `/v1/jobs/${id}/preview?max=${PREVIEW_SIDE}`, {signal});
      if (reply.status === 200 && number === this.latest) {
        this.show(number, {kind: ended ? 'refined' : 'refining', url: URL.createObjectURL(await reply.blob()), ...job.image,
                           milliseconds: performance.now() - begin, text, error: job.report?.error, job: id});
      }
      if (ended || job.state === 'cancelled') return;
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    }
  }

  stopRefining() {
    this.followed.abort();  // a cancelled job has no preview
    this.followed = new AbortController();
    if (this.refining) cancel(this.refining);
    this.refining = null;
  }

  /** @param {unknown} error @param {number} number */
  failed(error, number) {
    if (number !== this.latest || this.closed || !(error instanceof Problem)) return;
    this.problem.value = error;
  }

  close() {
    this.closed = true;
    clearTimeout(this.timer);
    this.inFlight?.abort();
    this.stopRefining();
    for (const old of [...this.history.value, this.shown.value]) for (const url of [old?.url, old?.under]) if (url) URL.revokeObjectURL(url);
  }
}

/** @param {string} id */
function cancel(id) {
  postJson('/v1/jobs/bulk', {action: 'cancel', ids: [id]}).catch(() => undefined);  // unlike the job's own route, no error if it has ended
}
