/** Differences of two JSON values, by JSON pointer. */

/** The values of a document by pointer. @param {any} value @param {string} at @param {Map<string, string>} into */
function flatten(value, at, into) {
  if (value === null || typeof value !== 'object' || (Array.isArray(value) && value.every((each) => typeof each !== 'object'))) into.set(at, JSON.stringify(value));
  else for (const [name, part] of Object.entries(value)) flatten(part, `${at}/${name.replaceAll('~', '~0').replaceAll('/', '~1')}`, into);
  return into;
}

/** @param {any} a @param {any} b @returns {{pointer: string, a: string, b: string}[]} */
export function documentDifference(a, b) {
  const first = flatten(a, '', new Map()), second = flatten(b, '', new Map());
  return [...new Set([...first.keys(), ...second.keys()])].filter((pointer) => first.get(pointer) !== second.get(pointer))
    .map((pointer) => ({pointer, a: first.get(pointer) ?? '', b: second.get(pointer) ?? ''}));
}
