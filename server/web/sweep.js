/** Sweeps: values by JSON pointer, and their order in a batch. */
import {orbited, rounded, viewOf} from './orbit.js';

/** @typedef {Record<string, any[]>} Sweep */

const VALUES_MAX = 10_000;

/** The leaves of a document by pointer: what a sweep can vary. @param {any} value @param {string} [at] @returns {[string, any][]} */
export function leaves(value, at = '') {
  if (value === null || typeof value !== 'object') return [[at, value]];
  return Object.entries(value).flatMap(([name, part]) => leaves(part, `${at}/${name.replaceAll('~', '~0').replaceAll('/', '~1')}`));
}

/** Values as people write them: "30..60:5", or JSON values with commas. Null: neither. @param {string} written @returns {any[] | null} */
export function valuesOf(written) {
  const range = /^\s*(-?[\d.]+(?:e-?\d+)?)\s*\.\.\s*(-?[\d.]+(?:e-?\d+)?)\s*(?::\s*([\d.]+(?:e-?\d+)?)\s*)?$/i.exec(written);
  if (!range) {
    try {
      const values = JSON.parse(`[${written}]`);
      return values.length > 0 ? values : null;
    } catch {
      return null;
    }
  }
  const [from, to, step] = [Number(range[1]), Number(range[2]), Number(range[3] ?? 1)];
  const steps = Math.floor(Math.abs(to - from) / step * (1 + Number.EPSILON * 8));
  if (!Number.isFinite(from + to) || !(step > 0) || steps >= VALUES_MAX) return null;
  return Array.from({length: steps + 1}, (_, i) => Number((from + Math.sign(to - from) * i * step).toPrecision(12)));
}

/** @param {Sweep} sweep */
export const combinations = (sweep) => Object.values(sweep).reduce((product, values) => product * values.length, 1);

/** The index of a job in its batch: the last pointer varies fastest. @param {Sweep} sweep @param {number[]} places of the values, one for each pointer */
export const indexOf = (sweep, places) => Object.values(sweep).reduce((index, values, axis) => index * values.length + places[axis], 0);

// ---- what varies in a batch of patches, as scripts submit them

/** Its job is no part of an image, and its name follows from the rest. */
const IGNORED = /^\/(job|name)(\/|$)/;

/** Values by pointer of a job's variation: those of a sweep have pointers, a patch has members. @param {any} values @returns {[string, any][]} */
function valuesAt(values) {
  const found = Object.keys(values || {}).some((name) => name.startsWith('/')) ? Object.entries(values) : leaves(values || {});
  return found.filter(([pointer]) => pointer && !IGNORED.test(pointer));
}

/** A number has five digits at most. @param {any} value */
export const shortValue = (value) => typeof value === 'number' ? String(Number(value.toPrecision(5))) : JSON.stringify(value).slice(0, 40);

/** "camera/fov 30" for each value of a variation. @param {any} values */
export const patchText = (values) => valuesAt(values).filter(([pointer]) => !pointer.endsWith('/type')).slice(0, 40).map(([pointer, value]) => `${pointer.slice(1)} ${shortValue(value)}`);

/** The pointers at which patches differ from each other, or from the base that all of them change. @param {any[]} patches @param {Map<string, any>} [base] leaves of the base */
export function variedPointers(patches, base) {
  /** @type {Map<string, Set<string>>} */
  const found = new Map();
  const all = patches.map((patch) => new Map(valuesAt(patch)));
  for (const pointer of new Set(all.flatMap((each) => [...each.keys()]))) {
    const known = all.filter((each) => each.has(pointer) || base);  // without the base the value of a patch that lacks one is not known
    found.set(pointer, new Set(known.map((each) => JSON.stringify(each.has(pointer) ? each.get(pointer) : base?.get(pointer)))));
  }
  return [...found].filter(([, values]) => values.size > 1).map(([pointer]) => pointer);
}

/**
 * The sweep that patches amount to: all combinations of values, in the order of a sweep. Null if they are none.
 * @param {any[]} patches by index @param {any} base the document that they change @returns {Sweep | null}
 */
export function sweepOfPatches(patches, base) {
  const before = new Map(leaves(base)), all = patches.map((patch) => new Map(valuesAt(patch)));
  const at = (/** @type {string} */ pointer, /** @type {number} */ index) => all[index].has(pointer) ? all[index].get(pointer) : before.get(pointer);
  const axes = variedPointers(patches, before).map((pointer) => {
    const values = new Map(all.map((_, index) => [JSON.stringify(at(pointer, index)), at(pointer, index)]));
    const order = new Map([...values.keys()].map((key, place) => [key, place]));
    return {pointer, values, order, steps: all.findIndex((_, index) => JSON.stringify(at(pointer, index)) !== JSON.stringify(at(pointer, 0)))};
  }).sort((a, b) => b.steps - a.steps);
  /** @type {Sweep} */
  const sweep = Object.fromEntries(axes.map(({pointer, values}) => [pointer, [...values.values()]]));
  if (axes.length === 0 || combinations(sweep) !== patches.length) return null;
  const places = (/** @type {number} */ index) => axes.map(({pointer, order}) => order.get(JSON.stringify(at(pointer, index))) ?? 0);
  return patches.every((_, index) => indexOf(sweep, places(index)) === index) ? sweep : null;
}

/** Views of a camera around what it looks at: positions at equal angles. Null without a position to turn. @param {any} scene @param {number} count */
export function turntable(scene, count) {
  const view = viewOf(scene);
  return view && Array.from({length: count}, (_, i) => rounded(orbited(view, 2 * Math.PI * i / count, 0)).position);
}
