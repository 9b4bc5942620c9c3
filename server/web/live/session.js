/** The live view of a page: follows the text of a document, and describes its image. */
import {signal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useMemo, useRef} from 'preact/hooks';
import {Problem, request} from '../api.js';
import {figure} from '../format.js';
import {documentOf, storeText} from '../job-source.js';
import {CameraDrag} from '../orbit.js';
import {announce, attempt, FullScreen} from '../parts.js';
import {pointerOf, placeIn} from '../pick.js';
import {applied} from '../pointers.js';
import {go} from '../routes.js';
import {words} from '../words.js';

/** @typedef {import('./live-view.js').State} State */
/** @typedef {{pointer: string, detail: string}} Omission */

const text = words.live, TYPING_PAUSE_MS = 150, BUSY_PAUSE_MS = 2000;

const isEqual = (/** @type {any} */ a, /** @type {any} */ b) => JSON.stringify(a) === JSON.stringify(b);

/** The codes of an image, four a pixel. @param {string} url */
async function imageCodes(url) {
  const image = new Image();
  image.src = url;
  await image.decode();
  const {naturalWidth: width, naturalHeight: height} = image, canvas = new OffscreenCanvas(width, height);
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext('2d', {willReadFrequently: true}));
  context.fillRect(0, 0, width, height);  // transparent parts count as black
  context.drawImage(image, 0, 0);
  return {width, height, codes: context.getImageData(0, 0, width, height).data};
}

export class LiveSession {
  constructor() {
    this.on = signal(false);
    /** @type {import('@preact/signals').Signal<State | null>} */
    this.state = signal(null);
    /** @type {import('@preact/signals').Signal<Omission[]>} */
    this.omitted = signal([]);
    /** A sentence: why there is no image. */
    this.problem = signal('');
    this.text = '';
    /** The latest image of the service, and its document. */
    this.image = {url: '', text: ''};
    /** @type {any} the document that the tables are of */
    this.scene = null;
    /** @type {import('./live-view.js').LiveView | null} */
    this.view = null;
    /** @type {import('./message.js').Live | null} */
    this.live = null;
    /** @type {import('./renderer.js').Camera | null} */
    this.camera = null;
    this.timer = 0;
    /** @type {AbortController | null} */
    this.inFlight = null;
    /** @type {HTMLElement | null} */
    this.host = null;
    /** @type {HTMLCanvasElement | null} */
    this.canvas = null;
    this.observer = new ResizeObserver(() => this.fit());
  }

  /** Switches the image on or off. @param {boolean} on @param {string} text of the editor @param {HTMLElement | null} host of the canvas */
  async set(on, text, host) {
    if (on === this.on.value) return;
    this.on.value = on;
    this.problem.value = '';
    if (!on) return this.end();
    this.text = text;
    try {
      const {LiveView} = await import('./live-view.js');
      if (!this.on.value || !host || this.view) return;
      const canvas = document.createElement('canvas');
      host.append(canvas);
      this.host = host;
      this.canvas = canvas;
      this.view = new LiveView(canvas, {onFrame: (state) => { this.state.value = state; }, onFailure: () => this.fail('lost')});
      this.observer.observe(/** @type {HTMLElement} */ (host.parentElement));
      this.fit();
      await this.compile();
    } catch (error) {
      this.fail(/** @type {Error} */ (error).message === 'WebGL2' ? 'unsupported' : /** @type {Error} */ (error).message);
    }
  }

  /** Ends with a reason; drafts come from the service again. @param {string} reason 'lost', 'unsupported' or a sentence */
  fail(reason) {
    if (!this.on.value) return;
    this.on.value = false;
    this.end();
    this.problem.value = reason;
  }

  end() {
    clearTimeout(this.timer);
    this.inFlight?.abort();
    this.observer.disconnect();
    this.view?.close();
    this.canvas?.remove();
    this.view = this.live = this.scene = this.camera = this.canvas = this.state.value = null;
    this.omitted.value = [];
  }

  fit() {
    if (!this.host) return;
    const density = devicePixelRatio || 1, {clientWidth: width, clientHeight: height} = /** @type {HTMLElement} */ (this.host.parentElement);
    this.view?.resize(Math.round(width * density), Math.round(height * density));
  }

  /** The text has changed. @param {string} text */
  edited(text) {
    this.text = text;
    if (this.view) this.follow();
  }

  /** The camera moves, and the text follows. @param {import('../orbit.js').View} view */
  viewed({position, look_at}) {
    if (!this.camera || !this.view) return;
    this.camera = {...this.camera, position, look_at};
    this.view.move(this.camera);
  }

  /** Shows the change at once if the tables can follow it; otherwise the service compiles the scene. */
  async follow() {
    let scene;
    try {
      scene = JSON.parse(this.text);
    } catch {
      return;  // the user is typing
    }
    const {changesOf, cameraOf} = await import('./message.js');
    if (!this.view) return;
    const changes = this.live && changesOf(this.live, this.scene, scene);
    if (!changes || !this.live) {
      clearTimeout(this.timer);
      this.timer = window.setTimeout(() => this.compile(), TYPING_PAUSE_MS);
      return;
    }
    this.scene = scene;
    this.problem.value = '';
    if (changes.rows.length > 0) this.view.update(changes.rows);
    if (changes.camera && !isEqual(this.camera, this.camera = cameraOf(this.live, scene))) this.view.move(this.camera);
  }

  async compile() {
    this.inFlight?.abort();
    const {signal} = this.inFlight = new AbortController(), text = this.text;
    try {
      const scene = JSON.parse(text);
      const [reply, {readLive}, {cameraOf}] = await Promise.all([request('POST', '/v1/live', {json: text, signal}), import('./live-view.js'), import('./message.js')]);
      const live = readLive(await reply.arrayBuffer());
      if (signal.aborted || !this.view) return;
      this.live = live;
      this.scene = scene;
      this.omitted.value = live.header.omitted;
      this.problem.value = '';
      this.view.load(live, this.camera = cameraOf(live, scene));
      if (this.text !== text) this.follow();
      else this.measure();
    } catch (error) {
      if (signal.aborted) return;
      this.problem.value = /** @type {Error} */ (error).message;
      if (error instanceof Problem && error.status === 503 && this.view) this.timer = window.setTimeout(() => this.compile(), BUSY_PAUSE_MS);
    }
  }

  /** Compares the image, when it rests, with an image of the service. @param {string} url @param {string} text its document */
  compare(url, text) {
    this.image = {url, text};
    this.measure();
  }

  async measure() {
    const {image, live, view} = this;
    if (!view || !live || image.text !== this.text) return;
    const reference = await imageCodes(image.url).catch(() => null);
    if (reference && live === this.live && image.text === this.text) view.compare(reference);
  }

  /** The object, counted from 1 in the order of the document, the pointer of its material, and the distance there; null for the background.
   * @param {{clientX: number, clientY: number}} pointer */
  pick(pointer) {
    const {canvas, view, live} = this, place = canvas && placeIn(canvas, pointer);
    if (!place || !view || !live) return undefined;
    const found = view.pick(place);
    return found && {object: pointerOf(this.scene, found.object), material: String(live.header.materials[found.material]), depth: found.depth};
  }
}

/** @param {{isOn: boolean, toggle: () => void}} properties */
export function LiveButton({isOn, toggle}) {
  return html`<button class="live-switch" aria-pressed=${isOn} title=${text.help} onClick=${toggle}>${text.name}</button>`;
}

/** @param {{live: LiveSession}} properties */
export function LiveProblem({live}) {
  const problem = live.problem.value;
  return problem ? html`<p class="banner" role="status">${text.problems[problem] || problem}</p>` : null;
}

/** @param {{live: LiveSession, goTo: (pointer: string) => void}} properties */
export function LiveCaption({live, goTo}) {
  const state = live.state.value;
  if (!state) return html`<span class="number live-caption" role="status">${text.waiting}</span>`;
  const {samples, wanted, width, height, rate, soft, truncated, distance} = state;
  const parts = [text.state(width, height)];
  if (wanted === 0) parts.push(text.moving(rate));
  else parts.push((soft ? text.soft : text.frames)(samples, wanted));
  if (truncated > 0) parts.push(text.truncated(truncated));
  if (distance !== null) parts.push(text.distance(figure(distance)));
  const omitted = live.omitted.value;
  return html`<span class="number live-caption" role="status" aria-live=${wanted > 0 && samples === wanted ? 'polite' : 'off'} tabindex="0" data-samples=${samples}>${parts.join(', ')}${omitted.length > 0 && html`, ${text.without} ${omitted.slice(0, 4).map(({pointer, detail}) => html`
    <button class="link" title=${detail} onClick=${() => goTo(pointer)}><code>${pointer}</code></button> `)}${omitted.length > 4 ? `+ ${omitted.length - 4}` : ''}`}</span>`;
}

/**
 * The live view in place of the image of a job. Its camera moves; the view on the screen goes on to the playground.
 * @param {{id: string, url: string, alt: string}} properties url of the job's image, or empty
 */
export function LiveStage({id, url, alt}) {
  const box = useRef(/** @type {HTMLElement | null} */ (null)), section = useRef(/** @type {HTMLElement | null} */ (null));
  const live = useMemo(() => new LiveSession(), [id]), document = useRef(''), original = useRef(''), image = useRef(url);
  const compare = () => { if (image.current && original.current) live.compare(image.current, original.current); };
  image.current = url;
  useEffect(compare, [url]);
  useEffect(() => {
    const ending = new AbortController();
    attempt(async () => {
      const before = document.current = original.current = await documentOf(id), {current} = box;
      if (ending.signal.aborted || !current) return;
      const editor = {text: () => document.current, change: (/** @type {any[]} */ changes) => { document.current = applied(document.current, changes); }};
      const name = (/** @type {PointerEvent} */ event) => announceFound(live.pick(event));
      new CameraDrag(editor, {beginDrag() {}, viewed: (view) => live.viewed(view), endDrag: () => live.edited(document.current)}, name).listen(current, ending.signal);
      compare();
      await live.set(true, before, current.querySelector('.live'));
    });
    return () => { ending.abort(); live.set(false, '', null); };
  }, [id]);
  const edit = (pointer = '') => {
    storeText(id, document.current);
    go(`#/edit/${id}?live=on${pointer && `&at=${encodeURIComponent(pointer)}`}`);
  };
  return html`<section class="viewer" ref=${section} aria-label=${alt}>
    <${LiveProblem} live=${live} />
    <div class="canvas" ref=${box} title=${text.hint} tabindex="0" role="group" aria-label=${words.playground.canvas}><div class="live"></div>${url && html`<img src=${url} style=${{objectFit: 'contain'}} alt=${alt} draggable=${false} />`}</div>
    <div class="caption"><${LiveCaption} live=${live} goTo=${edit} /><span class="spring"></span><button onClick=${() => edit()}>${text.edit}</button><${FullScreen} target=${section} /></div>
  </section>`;
}

/** Names what is under the pointer. @param {ReturnType<LiveSession['pick']>} found */
export function announceFound(found) {
  if (found !== undefined) announce(found ? text.picked(found.object || '', found.material) : words.playground.background);
}
