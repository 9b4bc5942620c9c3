/** The live form of a scene, as POST /v1/live sends it (api/docs/http.md), and the changes of a document that it can follow. */
import {scaled, sub, unit} from '../orbit.js';

/** @typedef {{columns: number, rows: number, values: Float32Array | Uint32Array}} Table */
/** @typedef {Record<string, any>} Header */
/** @typedef {{header: Header, tables: Record<string, Table>}} Live */
/** @typedef {'materials' | 'lights'} TableName */
/** @typedef {{table: TableName, cell: number, cells: number}} Row */

const MAGIC = 0x4556494c;
const LIGHT_CELLS = 7;
/** The index of a field's first number in the row of a light (tracer/include/tracer/live.h). @type {Record<string, number>} */
const LIGHT_FIELDS = {color: 4, intensity: 7};
const NO_VECTOR = [NaN];
const isVector = (/** @type {any} */ v) => Array.isArray(v) && v.length === 3 && v.every(Number.isFinite);
const cosine = (/** @type {any} */ degrees) => typeof degrees === 'number' ? [Math.cos(degrees * Math.PI / 180)] : NO_VECTOR;
/** Places and numbers of the geometry of a light in its row, by the field that changed: tracer/src/lights/light_registry.h.
 * @type {Record<string, (light: any, point: (v: any) => number[], vector: (v: any) => number[]) => [number, number[]][]>} */
const GEOMETRY = {
  position: ({position}, point) => [[0, point(position)]], center: ({center}, point) => [[0, point(center)]], corner: ({corner}, point) => [[0, point(corner)]],
  direction: ({type, direction: d}) => [[8, isVector(d) ? scaled(unit(d), type === 'directional' ? -1 : 1) : NO_VECTOR]],
  inner_angle: ({inner_angle: angle}) => [[11, cosine(angle)]], outer_angle: ({outer_angle: angle}) => [[15, cosine(angle)]],
  from: ({from, to}, point, vector) => [[0, point(from)], [12, isVector(from) && isVector(to) ? vector(sub(to, from)) : NO_VECTOR]], to: (...all) => GEOMETRY.from(...all),
  edge_u: ({edge_u: edge}, _, vector) => [[12, vector(edge)]], edge_v: ({edge_v: edge}, _, vector) => [[16, vector(edge)]],
  radius: ({type, radius}, _, vector) => [[19, type === 'sphere' ? vector([radius, 0, 0]).slice(0, 1) : NO_VECTOR]],
};

/** @param {ArrayBuffer} bytes @returns {Live} */
export function readLive(bytes) {
  const [magic, size] = bytes.byteLength < 8 ? [0, 0] : new Uint32Array(bytes, 0, 2);
  if (magic !== MAGIC) throw new Error('not a live form');
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 8, size)));
  /** @type {Record<string, Table>} */
  const tables = {};
  for (const {name, type, columns, rows, offset} of header.tables) {
    const Values = type === 'float32' ? Float32Array : Uint32Array;
    tables[name] = {columns, rows, values: new Values(bytes, 8 + size + offset, rows * columns)};
  }
  return {header, tables};
}

/** The sRGB curve (IEC 61966-2-1), decoded. @param {number} c */
const linear = (c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;

/** A color of a document as linear numbers; nothing for forms that only the service reads. @param {any} value @returns {number[] | null} */
export function colorOf(value) {
  if (typeof value === 'number') return [value, value, value];
  if (Array.isArray(value)) return value.length === 3 && value.every((each) => typeof each === 'number') ? value : null;
  const hex = typeof value === 'string' && /^#([0-9a-f]{3}|[0-9a-f]{6})$/i.exec(value)?.[1];
  if (!hex) return null;
  return [0, 1, 2].map((i) => linear(parseInt(hex.length === 3 ? hex[i] + hex[i] : hex.slice(2 * i, 2 * i + 2), 16) / 255));
}

/** @param {any} a @param {any} b */
const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
/** The places and numbers of a changed field in its row; nothing if the service must compile the scene again.
 * @param {Header} header @param {TableName} table @param {string} field @param {any} before @param {any} after objects of the document @returns {[number, number[]][] | null} */
function numbersOf({origin, scale, material_fields}, table, field, {[field]: old}, after) {
  const now = after[field];
  if (table === 'lights' && field in GEOMETRY) {
    const vector = (/** @type {any} */ v) => isVector(v) ? scaled(v, scale) : NO_VECTOR;
    const writes = GEOMETRY[field](after, (v) => isVector(v) ? vector(sub(v, origin)) : NO_VECTOR, vector);
    return writes.every(([, numbers]) => numbers.every(Number.isFinite)) ? writes : null;
  }
  const at = (table === 'lights' ? LIGHT_FIELDS : material_fields)[field];
  if (at === undefined || field === 'priority') return null;
  if (field.endsWith('color') || ['emission', 'opacity', 'absorption'].includes(field)) {
    const from = colorOf(old), color = colorOf(now);
    if (!from || !color || color.some((each) => !(each >= 0))) return null;
    const isAll = (/** @type {number[]} */ c, /** @type {number} */ value) => c.every((each) => each === value);
    if (field === 'opacity' && (isAll(from, 1) || isAll(color, 1))) return null;
    return isAll(from, 0) === isAll(color, 0) ? [[at, color]] : null;
  }
  // A number that becomes or was zero may change the features that a scene needs.
  if (typeof old !== 'number' || typeof now !== 'number' || now < 0 || (old === 0) !== (now === 0)) return null;
  return field === 'ior' && (old === 1 || now === 1) ? null : [[at, [now]]];
}

/**
 * Follows the change of a document: writes numbers and colors of materials and lights into the tables. Nothing if the scene must be
 * compiled again; then nothing is written.
 * @param {Live} live @param {any} before @param {any} after documents @returns {{camera: boolean, rows: Row[]} | null}
 */
export function changesOf(live, before, after) {
  /** @type {Map<string, {table: TableName, row: number}>} */
  const places = new Map();
  live.header.materials.forEach((/** @type {string} */ pointer, /** @type {number} */ row) => places.set(pointer, {table: 'materials', row}));
  for (let row = 0; row < live.tables.lights.rows / LIGHT_CELLS; ++row) places.set(`/lights/${row}`, {table: 'lights', row});
  /** @type {{table: TableName, row: number, at: number, numbers: number[]}[]} */
  const writes = [];
  const walk = (/** @type {string} */ pointer, /** @type {any} */ a, /** @type {any} */ b) => {
    if (a === b) return true;
    if (!a || !b || typeof a !== 'object' || typeof b !== 'object') return false;
    const names = Object.keys(a);
    if (Array.isArray(a) !== Array.isArray(b) || !same(names, Object.keys(b))) return false;
    const place = places.get(pointer);
    if (place?.table === 'lights' && b.visible) return same(a, b);  // the surface of such a light has its color too
    for (const name of names) {
      if (same(a[name], b[name])) continue;
      const numbers = place && numbersOf(live.header, place.table, name, a, b);
      if (numbers) writes.push(...numbers.map(([at, each]) => ({...place, at, numbers: each})));
      else if (place || !walk(`${pointer}/${name.replaceAll('~', '~0').replaceAll('/', '~1')}`, a[name], b[name])) return false;
    }
    return true;
  };
  const rest = (/** @type {any} */ {camera: _, name: __, job: ___, ...others}) => others;
  const {up, layout, eye_separation: eyes} = before.camera || {}, now = after.camera || {};
  if (!same([up, layout, eyes], [now.up, now.layout, now.eye_separation]) || !walk('', rest(before), rest(after))) return null;
  const cells = {materials: live.header.material_cells, lights: LIGHT_CELLS};
  for (const {table, row, at, numbers} of writes) live.tables[table].values.set(numbers, 4 * cells[table] * row + at);
  const rows = writes.map(({table, row}) => ({table, cell: cells[table] * row, cells: cells[table]}));
  return {camera: !same(before.camera, after.camera), rows};
}

/** The camera of a document with the defaults of the scene that was compiled. @param {Live} live @param {any} scene @returns {import('./renderer.js').Camera} */
export function cameraOf({header}, scene) {
  const {camera} = scene, isNumber = (/** @type {any} */ value) => typeof value === 'number';
  const own = Object.entries(camera || {}).filter(([, value]) => isNumber(value) || typeof value === 'string' || (Array.isArray(value) && value.every(isNumber)));
  return {...header.camera, focus_distance: null, ...Object.fromEntries(own)};
}
