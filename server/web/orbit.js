/** Moves the camera of a document: orbit around its look_at, pan, dolly. Y is up unless the camera has an `up`. */

/** @typedef {[number, number, number]} Vec */
/** @typedef {{position: Vec, look_at: Vec, up: Vec}} View */

/** @param {Vec} a @param {Vec} b @returns {Vec} */
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @param {Vec} a @param {number} s @returns {Vec} */
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
/** @param {Vec} a @param {Vec} b @returns {Vec} */
const sub = (a, b) => add(a, scaled(b, -1));
/** @param {Vec} a @param {Vec} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {Vec} a @param {Vec} b @returns {Vec} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Vec} a */
const length = (a) => Math.hypot(...a);
/** @param {Vec} a */
const unit = (a) => scaled(a, 1 / (length(a) || 1));

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

/** Four significant digits of the distance are enough for the eye. @param {View} view @returns {View} */
export function rounded(view) {
  const step = 10 ** (Math.floor(Math.log10(length(sub(view.position, view.look_at)) || 1)) - 3);
  const places = Math.max(0, -Math.log10(step));
  const round = (/** @type {Vec} */ a) => /** @type {Vec} */ (a.map((part) => Number((Math.round(part / step) * step).toFixed(places))));
  return {...view, position: round(view.position), look_at: round(view.look_at)};
}
