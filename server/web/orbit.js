/** Moves the camera of a document: orbit around its look_at, pan, dolly, walk. Y is up unless the camera has an `up`. */
import {applied, changesTo, wholeRangeOf} from './pointers.js';

/** Pixels that a pointer moves in a click. */
const CLICK_MOVE_MAX = 3;
/** A press of an arrow key turns the view by radians, or moves it by parts of the height of the image. */
const KEY_TURN = Math.PI / 24, KEY_PAN = 0.05, DOLLY = 0.08, PAUSE_MS = 250;

/** @typedef {[number, number, number]} Vec */
/** @typedef {{position: Vec, look_at: Vec, up: Vec}} View */

/** @param {Vec} a @param {Vec} b @returns {Vec} */
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @param {Vec} a @param {number} s @returns {Vec} */
export const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
/** @param {Vec} a @param {Vec} b @returns {Vec} */
export const sub = (a, b) => add(a, scaled(b, -1));
/** @param {Vec} a @param {Vec} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {Vec} a @param {Vec} b @returns {Vec} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Vec} a */
export const length = (a) => Math.hypot(...a);
/** @param {Vec} a */
export const unit = (a) => scaled(a, 1 / (length(a) || 1));

/** Rodrigues' rotation. @param {Vec} a @param {Vec} axis unit @param {number} angle radians @returns {Vec} */
function rotated(a, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return add(add(scaled(a, c), scaled(cross(axis, a), s)), scaled(axis, dot(axis, a) * (1 - c)));
}

/** The camera of a scene; nothing if it has no position. @param {any} scene @returns {View | null} */
export function viewOf(scene) {
  const {position, look_at, up} = scene?.camera || {};
  if (!Array.isArray(position) || !Array.isArray(look_at)) return null;
  return {position: /** @type {Vec} */ (position), look_at: /** @type {Vec} */ (look_at), up: Array.isArray(up) ? /** @type {Vec} */ (up) : [0, 1, 0]};
}

/** @param {View} view @param {number} right radians @param {number} above radians @returns {View} */
export function orbited(view, right, above) {
  const axis = unit(view.up), arm = sub(view.position, view.look_at);
  const elevation = Math.asin(Math.max(-1, Math.min(1, dot(unit(arm), axis))));
  const limit = Math.PI / 2 - 0.02;  // at the pole the camera would turn over
  const tilt = Math.max(-limit, Math.min(limit, elevation + above)) - elevation;
  const side = unit(cross(axis, arm));
  return {...view, position: add(view.look_at, rotated(rotated(arm, side, -tilt), axis, -right))};
}

/** @param {View} view @param {number} right share of the distance @param {number} above @returns {View} */
export function panned(view, right, above) {
  const arm = sub(view.position, view.look_at), distance = length(arm);
  const side = unit(cross(unit(view.up), arm)), top = unit(cross(arm, side));
  const shift = add(scaled(side, -right * distance), scaled(top, above * distance));
  return {...view, position: add(view.position, shift), look_at: add(view.look_at, shift)};
}

/** @param {View} view @param {number} factor of the distance @returns {View} */
export function dollied(view, factor) {
  return {...view, position: add(view.look_at, scaled(sub(view.position, view.look_at), factor))};
}

/** Moves the camera and its look_at in the direction of sight and to the right. @param {View} view @param {number} right share of the distance @param {number} ahead @returns {View} */
export function walked(view, right, ahead) {
  const arm = sub(view.look_at, view.position), side = unit(cross(unit(arm), unit(view.up)));
  const shift = add(scaled(arm, ahead), scaled(side, right * length(arm)));
  return {...view, position: add(view.position, shift), look_at: add(view.look_at, shift)};
}

/** Four significant digits of the distance are enough for the eye. @param {View} view @returns {View} */
export function rounded(view) {
  const step = 10 ** (Math.floor(Math.log10(length(sub(view.position, view.look_at)) || 1)) - 3);
  const places = Math.max(0, -Math.log10(step));
  const round = (/** @type {Vec} */ a) => /** @type {Vec} */ (a.map((part) => Number((Math.round(part / step) * step).toFixed(places))));
  return {...view, position: round(view.position), look_at: round(view.look_at)};
}

/** Turns drags and the wheel into changes of the camera, as one step of the editor's history. */
export class CameraDrag {
  /**
   * @param {{text: () => string, change: (changes: import('./pointers.js').Change[], isStep?: boolean) => void}} editor of the document
   * @param {{beginDrag: () => void, viewed: (view: View) => void, endDrag: () => void}} drafts @param {(event: PointerEvent) => void} onClick
   */
  constructor(editor, drafts, onClick) {
    this.editor = editor;
    this.drafts = drafts;
    this.onClick = onClick;
    /** @type {View | null} */
    this.view = null;
    this.before = this.text = '';
    /** The camera in the text; to look it up takes 0.1 s in a large one. */
    this.from = 0;
    this.camera = '';
    this.stepTimer = 0;
  }

  /** Follows pointer, wheel and keys until the signal. @param {HTMLElement} box @param {AbortSignal} signal */
  listen(box, signal) {
    box.addEventListener('pointerdown', (event) => this.pointer(event), {signal});
    box.addEventListener('keydown', (event) => this.press(event), {signal});
    box.addEventListener('wheel', (event) => this.wheel(event), {signal, passive: false});
  }

  begin() {
    const text = this.editor.text();
    if (this.view && text === this.text) return true;
    this.before = this.text = text;
    try {
      this.view = viewOf(JSON.parse(text));
    } catch {
      this.view = null;
    }
    const range = this.view && wholeRangeOf(text, ['camera']);
    if (!range) return false;
    this.from = range.from;
    this.camera = text.slice(range.from, range.to);
    this.drafts.beginDrag();
    return true;
  }

  /** @param {View} view */
  move(view) {
    this.view = view;
    const {position, look_at} = rounded(view);
    const camera = Object.entries({position, look_at}).reduce((text, [name, value]) => applied(text, changesTo(text, [name], value)), this.camera);
    this.editor.change([{from: this.from, to: this.from + this.camera.length, insert: camera}], false);
    this.camera = camera;
    this.text = this.editor.text();
    this.drafts.viewed({...view, position, look_at});
  }

  end() {
    if (!this.view) return;
    this.view = null;
    const after = this.editor.text();
    if (after !== this.before) {
      const {from, to, insert} = difference(after, this.before);
      this.editor.change([{from, to, insert}], false);
      this.editor.change([difference(this.before, after)]);
    }
    this.drafts.endDrag();
  }

  /** @param {PointerEvent} down */
  pointer(down) {
    const box = /** @type {HTMLElement} */ (down.currentTarget);
    if (down.button !== 0) return;
    const pan = down.shiftKey;
    /** @type {View | null} */
    let start = null;
    box.setPointerCapture(down.pointerId);
    box.onpointermove = (event) => {
      const x = event.clientX - down.clientX, y = event.clientY - down.clientY;
      if (!start && Math.hypot(x, y) <= CLICK_MOVE_MAX) return;
      if (!start && this.begin()) start = this.view;
      if (!start) return;
      const dx = x / box.clientHeight, dy = y / box.clientHeight;
      this.move(pan ? panned(start, dx, dy) : orbited(start, dx * Math.PI, dy * Math.PI));
    };
    box.onpointerup = box.onpointercancel = (event) => {
      box.onpointermove = box.onpointerup = box.onpointercancel = null;
      if (start) this.end();
      else if (event.type === 'pointerup') this.onClick(event);
    };
  }

  /** @param {WheelEvent} event */
  wheel(event) { this.step(event, (view) => dollied(view, Math.exp(Math.sign(event.deltaY) * DOLLY))); }

  /** The arrow keys orbit, and pan with the shift key; + and - come closer and go back; W A S D walk. @param {KeyboardEvent} event */
  press(event) {
    const [x, y] = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key] || [0, 0];
    const closer = {'+': -1, '-': 1}[event.key] || 0, [right, ahead] = {w: [0, 1], a: [-1, 0], s: [0, -1], d: [1, 0]}[event.key.toLowerCase()] || [0, 0];
    if (event.ctrlKey || event.metaKey || event.altKey || (!x && !y && !closer && !right && !ahead)) return;
    this.step(event, (view) => right || ahead ? walked(view, right * KEY_PAN, ahead * KEY_PAN) : closer ? dollied(view, Math.exp(closer * DOLLY))
      : event.shiftKey ? panned(view, x * KEY_PAN, y * KEY_PAN) : orbited(view, x * KEY_TURN, y * KEY_TURN));
  }

  /** A change of the view that has no end of its own. @param {Event} event @param {(view: View) => View} change */
  step(event, change) {
    if (!this.begin() || !this.view) return;
    event.preventDefault();
    event.stopPropagation();
    this.move(change(this.view));
    clearTimeout(this.stepTimer);
    this.stepTimer = window.setTimeout(() => this.end(), PAUSE_MS);
  }
}

/** The smallest change that makes `after` of `before`. @param {string} before @param {string} after */
function difference(before, after) {
  let from = 0, same = 0;
  while (from < before.length && before[from] === after[from]) ++from;
  const most = Math.min(before.length, after.length) - from;
  while (same < most && before[before.length - 1 - same] === after[after.length - 1 - same]) ++same;
  return {from, to: before.length - same, insert: after.slice(from, after.length - same)};
}
