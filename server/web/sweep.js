/** Sweeps: values by JSON pointer, and their order in a batch. */

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
