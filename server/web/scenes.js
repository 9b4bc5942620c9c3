/** Scenes that the playground begins with: the examples as images, documents that are opened or dropped, texts in links and in commands. */
import {signal, useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {key, mayWrite, postJson, request} from './api.js';
import {draftOf} from './draft.js';
import {documentOf, storedText} from './job-source.js';
import {announce, Icon} from './parts.js';
import {changesTo, readable} from './pointers.js';
import {go} from './routes.js';
import {Caller} from './workers.js';
import {words} from './words.js';

const FIRST_EXAMPLE = 'shapes', SIDE = 240, SAMPLES = 4, SIZE = {width: 640, height: 480};
/** Those of the first view. */
const SHOWN_FIRST = ['shapes', 'cornell', 'transparency', 'lens', 'torus', 'haze', 'isometric', 'shading'];
const LINK_BYTES_MAX = 32_000, TEXT_MAX = 8_000_000;
const text = words.scenes;

/** @type {Promise<Record<string, string>> | undefined} */
let examples;
/** Documents by name. @returns {Promise<Record<string, string>>} */
export function loadExamples() { return examples ??= fetch(new URL('./examples.json', import.meta.url)).then((reply) => reply.json()); }

/** The text that the playground begins with. @param {string} job whose document is edited; empty: that of no job */
export async function firstText(job) {
  return storedText(job) ?? (job ? readable(await documentOf(job)) : (await loadExamples())[FIRST_EXAMPLE]);
}

/** A text that replaces that of the playground, as a step that can be undone. */
export const opened = signal('');

/** @param {string} document */
function open(document) {
  opened.value = document;
  go('#/new');
}

// ---- files

/** @param {File} file */
export const isDocument = (file) => file.type === 'application/json' || file.name.endsWith('.json');

/** Opens the documents among the files; returns the others. @param {FileList | File[] | null | undefined} files */
export async function openDocuments(files) {
  const all = [...(files || [])];
  for (const file of all.filter(isDocument)) open(await file.text());
  return all.filter((file) => !isDocument(file));
}

/** A button that chooses files. @param {{onFiles: (files: File[]) => void, accept: string, children?: any}} properties */
export function FileButton({onFiles, accept, children}) {
  const field = useRef(/** @type {HTMLInputElement | null} */ (null));
  const read = () => {
    onFiles([...(field.current?.files || [])]);
    if (field.current) field.current.value = '';
  };
  return html`<button title=${text.openHelp} onClick=${() => field.current?.click()}>${children}</button><input ref=${field} type="file" hidden accept=${accept} aria-label=${text.open} onChange=${read} />`;
}

/** Files that are dropped anywhere but in the editor; the browser would leave the page for them. */
export function acceptDrops() {
  addEventListener('dragover', (event) => event.preventDefault());
  window.addEventListener('drop', async (event) => {
    if (event.defaultPrevented) return;
    event.preventDefault();
    const others = mayWrite.value ? await openDocuments(event.dataTransfer?.files) : [];
    for (const file of others.filter(isModel)) await openModel(file);
    if (!others.every(isModel)) announce(text.dropInPlayground);
  });
}

// ---- uploads: once, under their SHA-256

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

/** @param {File} file */
const isModel = (file) => file.name.toLowerCase().endsWith('.glb');

/** Opens a document that stands for a model. @param {File} file */
async function openModel(file) {
  const {hash} = await upload(file);
  open(`${JSON.stringify({version: 1, name: file.name, model: `sha256:${hash}`}, null, 2)}\n`);
}

/** @param {string} text */
function isJson(text) {
  try {
    JSON.parse(text);
    return true;
  } catch {
    return false;
  }
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
    if (!inString && isJson(text)) {  // a name there would break the document: an image becomes one of its textures
      if (isModel(file)) {
        await openModel(file);
        continue;
      }
      if (!/^image\/|\.(exr|hdr)$/.test(file.type || file.name)) {
        announce(words.scenes.dropOnName(file.name));
        continue;
      }
      const name = file.name.replace(/\.\w+$/, ''), added = changesTo(text, ['textures', name], {file: JSON.parse(insert)});
      editor.change(added);
      editor.goTo(`/textures/${name.replaceAll('~', '~0').replaceAll('/', '~1')}`);
    } else editor.change([inString ? {from: begin, to: end + 1, insert} : {from: at, to: at, insert}]);
    announce(isNew ? words.playground.uploaded(file.name) : words.playground.known(file.name));
  }
}

// ---- links

/** @param {BlobPart} bytes @param {CompressionStream | DecompressionStream} stream */
const through = async (bytes, stream) => new Response(new Blob([bytes]).stream().pipeThrough(stream));

/** The address of the playground with a text; empty: it is too long for one. @param {string} document */
export async function linkTo(document) {
  const bytes = new Uint8Array(await (await through(document, new CompressionStream('deflate-raw'))).arrayBuffer());
  if (bytes.length > LINK_BYTES_MAX) return '';
  const base64 = btoa(bytes.reduce((all, byte) => all + String.fromCharCode(byte), ''));
  return `${location.origin}/#/new?text=${base64.replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '')}`;
}

/** The text of a link; null if it has none, or more than a document may have. @param {string} packed */
export async function textOfLink(packed) {
  try {
    if (packed.length > 2 * LINK_BYTES_MAX) return null;
    const bytes = Uint8Array.from(atob(packed.replaceAll('-', '+').replaceAll('_', '/')), (letter) => letter.charCodeAt(0));
    const found = await (await through(bytes, new DecompressionStream('deflate-raw'))).text();
    return found.length <= TEXT_MAX ? found : null;
  } catch {
    return null;
  }
}

// ---- programs that render a document without a browser: for a shell with curl, for Python, and for the command line of Whittle

/** @param {string} document */
function curl(document) {
  const keyed = key.value ? ' -H "Authorization: Bearer $WHITTLE_KEY"' : '';
  return `curl -s --fail --json @-${keyed} -H 'Accept: image/png' -o image.png ${location.origin}/v1/render <<'END'\n${document.trim()}\nEND\n`;
}

/** @param {string} document */
function python(document) {
  const text = document.trim(), literal = text.includes("'''") ? JSON.stringify(text) : `r'''${text}'''`;
  const keyed = key.value ? ', "Authorization": "Bearer " + os.environ["WHITTLE_KEY"]' : '';
  return `${key.value ? 'import os\n' : ''}import urllib.request

scene = ${literal}
headers = {"Content-Type": "application/json", "Accept": "image/png"${keyed}}
request = urllib.request.Request("${location.origin}/v1/render", scene.encode(), headers)
with urllib.request.urlopen(request) as reply, open("image.png", "wb") as file:
    file.write(reply.read())
`;
}

/** @param {string} document */
const whittle = (document) => `whittle render - -o image.png <<'END'\n${document.trim()}\nEND\n`;

/** By name, in the order of menus. @type {Record<'curl' | 'python' | 'whittle', (document: string) => string>} */
export const commands = {curl, python, whittle};

// ---- examples

/** Addresses of the images that the service has rendered, while the page is open. @type {Map<string, string>} */
const images = new Map();

/** A small image of an example, by the service itself; none of a scene that names files, which a service may not have. @param {string} name @param {AbortSignal} signal */
async function render(name, signal) {
  const document = (await loadExamples())[name];
  if (document.includes('"file"')) return '';
  const draft = draftOf(JSON.parse(document), null, SIZE, SIDE);
  const reply = await request('POST', '/v1/render', {signal, headers: {Accept: 'image/webp'},
                                                     json: {...draft, accuracy: {...draft.accuracy, samples: SAMPLES}, output: {...draft.output, formats: ['webp']}, job: {keep: false, priority: 0, cache: 'off'}}});
  if (reply.status === 200) images.set(name, URL.createObjectURL(await reply.blob()));
  return images.get(name) || '';
}

/** "Cornell box" of "cornell_box". @param {string} name */
const title = (name) => name[0].toUpperCase() + name.slice(1).replaceAll('_', ' ');

/** @param {{name: string}} properties */
function Example({name}) {
  const url = useSignal(images.get(name) || ''), link = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    if (url.value) return;
    const closing = new AbortController();
    const observer = new IntersectionObserver((entries) => {
      if (!entries.some((each) => each.isIntersecting)) return;
      observer.disconnect();
      render(name, closing.signal).then((made) => { if (!closing.signal.aborted) url.value = made; }, () => undefined);  // its name leads to it as well
    });
    if (link.current) observer.observe(link.current);
    return () => { observer.disconnect(); closing.abort(); };
  }, [name]);
  return html`<li><a href=${`#/new?example=${name}`} ref=${link}><span class="thumb">${url.value ? html`<img src=${url.value} alt="" />` : html`<${Icon} name="new" />`}</span>${title(name)}</a></li>`;
}

/** @param {{all?: boolean}} properties */
export function Gallery({all = false}) {
  const names = useSignal(/** @type {string[]} */ ([]));
  useEffect(() => { loadExamples().then((known) => { names.value = Object.keys(known).filter((name) => all || SHOWN_FIRST.includes(name)); }, () => undefined); }, []);
  return html`<ul class="gallery" aria-label=${words.playground.examples}>${names.value.map((name) => html`<${Example} key=${name} name=${name} />`)}</ul>`;
}
