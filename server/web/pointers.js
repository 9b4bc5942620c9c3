/** Places in a document's text by JSON pointer (RFC 6901), and changes of values that keep the rest of the text. */
import {findNodeAtLocation, getLocation, modify, parseTree} from 'jsonc-parser';

/** @typedef {{from: number, to: number}} Range */
/** @typedef {{from: number, to: number, insert: string}} Change */

/** @param {string} pointer "/objects/7" or, as a URI fragment, "#/objects/7" @returns {(string | number)[]} */
export function segments(pointer) {
  const path = pointer.startsWith('#') ? decodeURIComponent(pointer.slice(1)) : pointer;
  return path.split('/').slice(1).map((part) => {
    const name = part.replaceAll('~1', '/').replaceAll('~0', '~');
    return /^(0|[1-9]\d*)$/.test(name) ? Number(name) : name;
  });
}

/** Range of the value at `pointer`, or of the nearest part around it that exists. @param {string} text @param {string} pointer @returns {Range} */
export function rangeOf(text, pointer) {
  const root = parseTree(text);
  if (!root) return {from: 0, to: 0};
  for (let path = segments(pointer); ; path.pop()) {
    const node = findNodeAtLocation(root, path) || (path.length === 0 ? root : undefined);
    if (!node) continue;
    // An object or array is marked where it begins.
    const opens = node.type === 'object' || node.type === 'array';
    return {from: node.offset, to: node.offset + (opens ? 1 : node.length)};
  }
}

/** The whole range of the value at a path. @param {string} text @param {(string | number)[]} path @returns {Range | null} */
export function wholeRangeOf(text, path) {
  const root = parseTree(text), node = root && findNodeAtLocation(root, path);
  return node ? {from: node.offset, to: node.offset + node.length} : null;
}

/** @param {string} text @param {Change[]} changes in the order of the text */
export function applied(text, changes) {
  return changes.reduceRight((before, {from, to, insert}) => before.slice(0, from) + insert + before.slice(to), text);
}

/** The pointer of the value at `offset`. @param {string} text @param {number} offset */
export function pointerAt(text, offset) {
  return getLocation(text, offset).path.map((part) => '/' + String(part).replaceAll('~', '~0').replaceAll('/', '~1')).join('');
}

/** The changes that set the value at a path. @param {string} text @param {(string | number)[]} path @param {any} value @returns {Change[]} */
export function changesTo(text, path, value) {
  return modify(text, path, value, {}).map((edit) => ({from: edit.offset, to: edit.offset + edit.length, insert: edit.content}));
}

// ---- a text of one line, as programs write it, in lines

const LINE_MAX = 100, READABLE_MAX = 1_000_000;

/** The document in lines of what belongs together, each value as it is written. A text that has lines stays as it is. @param {string} text */
export function readable(text) {
  const root = text.length > READABLE_MAX || text.trim().includes('\n') ? undefined : parseTree(text);
  /** @param {import('jsonc-parser').Node} node @returns {string} */
  const flat = (node) => {
    const parts = (node.children || []).map(flat);
    if (node.type === 'property') return parts.join(': ');
    return node.type === 'object' ? `{${parts.join(', ')}}` : node.type === 'array' ? `[${parts.join(', ')}]` : text.slice(node.offset, node.offset + node.length);
  };
  /** @param {import('jsonc-parser').Node} node @param {string} indent @returns {string} */
  const lines = (node, indent) => {
    const whole = flat(node);
    if (indent.length + whole.length <= LINE_MAX || !node.children?.length) return whole;
    if (node.type === 'property') return `${flat(node.children[0])}: ${lines(node.children[1], indent)}`;
    const inner = node.children.map((child) => `\n${indent}  ${lines(child, indent + '  ')}`).join(',');
    return node.type === 'object' ? `{${inner}\n${indent}}` : `[${inner}\n${indent}]`;
  };
  return root ? lines(root, '') : text;
}

// ---- differences of two documents

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
