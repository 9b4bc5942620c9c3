/** Files of the user: uploaded once under their SHA-256, and named at the cursor if they are dropped into the editor. */
import {postJson, request} from './api.js';
import {announce} from './parts.js';
import {words} from './words.js';
import {Caller} from './workers.js';

/** @type {Caller | undefined} */
let hasher;

/** @param {File} file @returns {Promise<{hash: string, isNew: boolean}>} */
export async function upload(file) {
  hasher ??= new Caller('image-worker.js');
  const hash = await hasher.call({method: 'sha256', bytes: await file.arrayBuffer()});
  const {missing} = await postJson('/v1/assets/missing', {sha256: [hash]});
  if (missing.length > 0) {
    announce(words.playground.uploading(file.name));
    await request('PUT', `/v1/assets/${hash}`, {bytes: file, headers: {'Content-Type': 'application/octet-stream'}});
  }
  return {hash, isNew: missing.length > 0};
}

/** @param {import('./editor.js').Editor} editor @param {File[]} files @param {number} from where they were dropped */
export async function nameFiles(editor, files, from) {
  const place = editor.follow(from);
  for (const file of files) {
    const {hash, isNew} = await upload(file);
    const insert = `"sha256:${hash}"`;
    // Within a string the file's name replaces the string.
    const {at} = place, text = editor.text(), end = text.indexOf('"', at), begin = text.lastIndexOf('"', at - 1);
    const inString = begin >= 0 && end >= 0 && !/[\n:,{}[\]]/.test(text.slice(begin + 1, end)) && /[:,[]\s*$/.test(text.slice(0, begin));
    editor.change([inString ? {from: begin, to: end + 1, insert} : {from: at, to: at, insert}]);
    announce(isNew ? words.playground.uploaded(file.name) : words.playground.known(file.name));
  }
}
