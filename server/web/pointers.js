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
