/** The playground: editor, image and facts of one document. */
import {useComputed, useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {getJson, mayWrite, postJson} from './api.js';
import {commands} from './commands.js';
import {Drafts} from './draft.js';
import {Editor} from './editor.js';
import {nameFiles} from './drop.js';
import {count, duration, figure, size} from './format.js';
import {dollied, orbited, panned, rounded, viewOf} from './orbit.js';
import {documentOf, storedText, storeText} from './job-source.js';
import {announce, attempt, copy, Entry, Failure, NotModelled} from './parts.js';
import {pick, placeIn} from './pick.js';
import {applied, changesTo, wholeRangeOf} from './pointers.js';
import {go, route, routeOf} from './routes.js';
import {words} from './words.js';

const FIRST_EXAMPLE = 'shapes';
const text = words.playground;

/** @param {string} job whose document is edited; empty: that of no job */
async function firstText(job) {
  return storedText(job) ?? (job ? documentOf(job) : (await loadExamples())[FIRST_EXAMPLE]);
}

/** @type {Promise<Record<string, string>> | undefined} */
let examples;
/** @returns {Promise<Record<string, string>>} */
function loadExamples() { return examples ??= fetch(new URL('./examples.json', import.meta.url)).then((reply) => reply.json()); }

/** Pixels that a pointer moves in a click. */
const CLICK_MOVE_MAX = 3;

/** Turns drags and the wheel into changes of the camera, as one step of the editor's history. */
class CameraDrag {
  /** @param {Editor} editor @param {Drafts} drafts @param {(event: PointerEvent) => void} onClick */
  constructor(editor, drafts, onClick) {
    this.editor = editor;
    this.drafts = drafts;
    this.onClick = onClick;
    /** @type {import('./orbit.js').View | null} */
    this.view = null;
    this.before = this.text = '';
    /** The camera in the text; to look it up takes 0.1 s in a large one. */
    this.from = 0;
    this.camera = '';
    this.wheelTimer = 0;
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

  /** @param {import('./orbit.js').View} view */
  move(view) {
    this.view = view;
    const {position, look_at} = rounded(view);
    const camera = Object.entries({position, look_at}).reduce((text, [name, value]) => applied(text, changesTo(text, [name], value)), this.camera);
    this.editor.change([{from: this.from, to: this.from + this.camera.length, insert: camera}], false);
    this.camera = camera;
    this.text = this.editor.text();
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
    /** @type {import('./orbit.js').View | null} */
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
  wheel(event) {
    if (!this.begin() || !this.view) return;
    event.preventDefault();
    this.move(dollied(this.view, Math.exp(Math.sign(event.deltaY) * 0.08)));
    clearTimeout(this.wheelTimer);
    this.wheelTimer = window.setTimeout(() => this.end(), 250);
  }
}

/** The smallest change that makes `after` of `before`. @param {string} before @param {string} after */
export function difference(before, after) {
  let from = 0, same = 0;
  while (from < before.length && before[from] === after[from]) ++from;
  const most = Math.min(before.length, after.length) - from;
  while (same < most && before[before.length - 1 - same] === after[after.length - 1 - same]) ++same;
  return {from, to: before.length - same, insert: after.slice(from, after.length - same)};
}

/** @param {import('./draft.js').Shown} shown */
function caption(shown) {
  const kind = {draft: text.draft, refining: text.refining, refined: text.refined}[shown.kind];
  const error = shown.error ? `, ${text.error} ${figure(shown.error.estimate)} ${words.queue.levels}` : '';
  return `${kind} ${shown.width} × ${shown.height}, ${duration(shown.milliseconds / 1000)}${error}`;
}

/** @param {{id: string}} properties */
export function Playground({id}) {
  const host = useRef(/** @type {HTMLElement | null} */ (null));
  const canvas = useRef(/** @type {HTMLElement | null} */ (null));
  const editor = useRef(/** @type {Editor | null} */ (null));
  const drafts = useSignal(/** @type {Drafts | null} */ (null));
  const names = useSignal(/** @type {string[]} */ ([]));
  const failure = useSignal(/** @type {any} */ (null));

  useEffect(() => {
    let closed = false;
    /** @type {(() => void)[]} */
    const ends = [];
    (async () => {
      const [document, schema, known] = await Promise.all([firstText(id), getJson('/schemas/scene.schema.json'), loadExamples()]);
      if (closed || !host.current || !canvas.current) return;
      names.value = Object.keys(known);
      const properties = schema.properties.image.properties;
      const made = new Drafts({
        size: {width: properties.width.default, height: properties.height.default},
        onValidated: (_, result) => editor.current?.showIssues(result.errors, result.warnings),
      });
      const edit = editor.current = new Editor(host.current, {
        text: document,
        onChange: (value) => {
          storeText(id, value);
          if (!made.dragging && value.length < 1_000_000) edit.lint();
          made.edited(value);
        },
        onSubmit: () => made.now(),
        onDrop: (files, at) => attempt(() => nameFiles(edit, files, at)),
      });
      edit.setSchema(schema);
      const box = canvas.current;
      const goToObject = (/** @type {PointerEvent} */ event) => attempt(async () => {
        const shown = made.shown.value, image = box.querySelector('img');
        // An image of an earlier text, or of a window of the image, has other objects in its places.
        if (!mayWrite.value || !shown || image?.src !== shown.url || !made.validation.value?.valid) return;
        const scene = JSON.parse(edit.text()), place = placeIn(image, event);
        if (!place || (scene.image?.crop && shown.kind !== 'draft')) return;
        const pointer = await pick(scene, place, made.size);
        if (pointer) edit.goTo(pointer);
        else announce(text.background);
      });
      const camera = new CameraDrag(edit, made, goToObject);
      const down = (/** @type {PointerEvent} */ event) => camera.pointer(event), wheel = (/** @type {WheelEvent} */ event) => camera.wheel(event);
      box.addEventListener('pointerdown', down);
      box.addEventListener('wheel', wheel, {passive: false});
      ends.push(() => { box.removeEventListener('pointerdown', down); box.removeEventListener('wheel', wheel); made.close(); edit.destroy(); });
      drafts.value = made;
      made.edited(document);
      const accuracy = route.value.query.get('accuracy');
      if (accuracy) edit.change(changesTo(document, ['accuracy'], JSON.parse(accuracy)));
      const pointer = accuracy ? '/accuracy' : route.value.query.get('at');
      if (pointer) edit.goTo(pointer);
    })().catch((error) => { failure.value = error; });
    return () => { closed = true; ends.forEach((end) => end()); editor.current = null; };
  }, [id]);

  const choose = async (/** @type {string} */ name) => editor.current?.setText((await loadExamples())[name]);
  return html`<div class="playground">
    <${Bar} id=${id} editor=${editor} drafts=${drafts} names=${names} choose=${choose} />
    <div class="edit"><${Failure} problem=${failure.value} /><div class="editor" ref=${host}></div></div>
    <${Stage} box=${canvas} drafts=${drafts} editor=${editor} />
    <${Facts} drafts=${drafts} editor=${editor} />
  </div>`;
}

/** @param {{id: string, editor: {current: Editor | null}, drafts: import('@preact/signals').Signal<Drafts | null>, names: import('@preact/signals').Signal<string[]>, choose: (name: string) => void}} properties */
function Bar({id, editor, drafts, names, choose}) {
  const made = drafts.value;
  const busy = useSignal(false);
  const submit = (/** @type {string} */ path) => attempt(async () => {
    if (busy.value) return;
    busy.value = true;
    try {
      const value = editor.current?.text() || '';
      go(routeOf(await postJson(path, path === '/v1/measure' ? `{"scene": ${value}}` : value)));
    } catch (error) {
      busy.value = false;
      throw error;
    }
  });
  const copyAs = (/** @type {string} */ name) => { if (name in commands) copy(commands[/** @type {'curl'} */ (name)](editor.current?.text() || '')); };
  const isOff = made?.validation.value?.valid === false || busy.value;
  // Not at the choice: an arrow key chooses, and the next one goes on from there.
  const reset = (/** @type {any} */ event) => { event.target.value = ''; };
  return html`<div class="bar">
    <h1>${words.titles.new}</h1>
    <select aria-label=${text.examples} onChange=${(/** @type {any} */ event) => { if (event.target.value) choose(event.target.value); }} onBlur=${reset}>
      <option value="">${text.choose}</option>
      ${names.value.map((name) => html`<option value=${name}>${name}</option>`)}
    </select>
    ${made && mayWrite.value && html`
      <label class="switch" title=${text.autoHelp}><input type="checkbox" checked=${made.auto.value} onChange=${() => made.setAuto(!made.auto.value)} />${text.auto}</label>
      <label class="switch" title=${text.refineHelp}><input type="checkbox" checked=${made.refine.value} onChange=${() => { made.refine.value = !made.refine.value; }} />${text.refine}</label>
      ${(!made.auto.value || made.manualReason.value) && html`<button onClick=${() => { editor.current?.flush(); made.now(); }}>${text.draftNow} <kbd>${text.draftKey}</kbd></button>`}`}
    <span class="spring"></span>
    <select aria-label=${text.copyAs} onChange=${(/** @type {any} */ event) => copyAs(event.target.value)} onBlur=${reset}>
      <option value="">${text.copyAs}</option>
      ${Object.keys(commands).map((name) => html`<option value=${name}>${text.commands[/** @type {'curl'} */ (name)]}</option>`)}
    </select>
    ${made && mayWrite.value && html`
      <button title=${text.measureHelp} disabled=${isOff} onClick=${() => submit('/v1/measure')}>${text.measure}</button>
      <a class="button" href=${`#/batches/new${id && `?edit=${id}`}`} title=${words.batches.sweepHelp}>${words.batches.sweep}</a>
      <button class="primary" title=${text.renderHelp} disabled=${isOff} onClick=${() => submit('/v1/jobs')}>${text.render}</button>`}
  </div>`;
}

/** @param {{box: {current: HTMLElement | null}, drafts: import('@preact/signals').Signal<Drafts | null>, editor: {current: Editor | null}}} properties */
function Stage({box, drafts, editor}) {
  const made = drafts.value;
  const older = made?.older.value;
  const show = (/** @type {import('./draft.js').Shown | null} */ image) => { if (made) made.older.value = image; };
  const shown = older || made?.shown.value;
  const manual = made?.manualReason.value;
  const restore = () => {
    if (older) editor.current?.setText(older.text);
    show(null);
  };
  return html`<section class="stage" aria-label=${words.titles.new}>
    ${manual && html`<p class="banner">${manual === 'size' ? text.manual.size : text.manual.time}</p>`}
    <div class="canvas" ref=${box} title=${text.hint}>
      ${shown ? html`<img class=${shown.kind === 'refined' ? '' : 'soft'} src=${shown.url} style=${{backgroundImage: shown.under ? `url(${shown.under})` : 'none'}} alt=${text.imageAlt} draggable=${false} data-kind=${shown.kind} data-job=${shown.job || ''} />`
        : html`<div class="empty"><h2>${text.waiting}</h2><p>${text.waitingText}</p></div>`}
    </div>
    <div class="caption">
      <span class="number" role="status">${older ? text.older + ': ' : ''}${shown ? caption(shown) : ''}</span>
      <span class="spring"></span>
      ${older && html`<button onClick=${restore}>${text.restore}</button><button class="quiet" onClick=${() => show(null)}>${text.backToNow}</button>`}
    </div>
    <${Failure} problem=${made?.problem.value || null} />
    <div class="film" role="group" aria-label=${text.history}>
      ${made && made.history.value.length > 0 ? made.history.value.map((each) => html`<button key=${each.url} aria-pressed=${each === older} aria-label=${text.older}
          onClick=${() => show(each === older ? null : each)}><img src=${each.url} alt="" /></button>`)
        : html`<span class="dim">${text.historyEmpty}</span>`}
    </div>
  </section>`;
}

/** @param {{drafts: import('@preact/signals').Signal<Drafts | null>, editor: {current: Editor | null}}} properties */
function Facts({drafts, editor}) {
  const validation = useComputed(() => drafts.value?.validation.value || null).value;
  const goTo = (/** @type {string} */ pointer) => editor.current?.goTo(pointer);
  if (!validation) return html`<aside class="facts" aria-label=${text.facts}></aside>`;
  const {estimate, errors, warnings} = validation;
  const reasons = Object.entries(validation.reasons || {});
  return html`<aside class="facts" aria-label=${text.facts}>
    ${errors.length > 0 && html`<section><h2>${text.problems}</h2><p>${text.invalid(errors.length)}</p><${Issues} issues=${errors} goTo=${goTo} /></section>`}
    ${warnings.length > 0 && html`<section><h2>${text.warnings}</h2><${Issues} issues=${warnings} goTo=${goTo} /></section>`}
    ${estimate && html`<section><h2>${text.estimate}</h2><dl>
      <dt>${text.seconds}</dt><dd class="number">${estimate.seconds === null ? text.notYet : '≈ ' + duration(estimate.seconds)}</dd>
      <dt>${text.samples}</dt><dd class="number">${count(estimate.samples)}</dd>
      <dt>${text.memory}</dt><dd class="number">${size(estimate.memory_bytes)}</dd></dl></section>`}
    ${estimate && html`<section><h2>${text.accuracy}</h2><${Target} editor=${editor} /></section>`}
    ${validation.valid && html`<section><h2>${text.needs}</h2>${reasons.length === 0 ? html`<p class="dim">${text.noReasons}</p>` : html`<ul>${reasons.map(([name, pointer]) => html`
      <li>${name.replaceAll('_', ' ')} <button class="link" onClick=${() => goTo(String(pointer))}><code>${String(pointer)}</code></button></li>`)}</ul>`}<${NotModelled} requirements=${validation.requirements} /><p class="dim">${text.globalLight(validation.global_light || '')}</p></section>`}
  </aside>`;
}

/** The target error of the document, and a field to change it. @param {{editor: {current: Editor | null}}} properties */
function Target({editor}) {
  const value = () => {
    try {
      return JSON.parse(editor.current?.text() || '{}').accuracy || {};
    } catch {
      return null;  // the user is typing
    }
  };
  const set = (/** @type {any} */ event) => {
    const {model, approximate, max_depth, cutoff} = value() || {}, target = Number(event.target.value);
    if (target > 0 && value()) editor.current?.change(changesTo(editor.current.text(), ['accuracy'], {model, target_error: target, approximate, max_depth, cutoff}));
  };
  return html`<label class="target-field">${text.target}<${Entry} type="number" class="target" min="0" step="any" value=${value()?.target_error ?? ''} onChange=${set} /> ${words.queue.levels}</label>`;
}

/** @param {{issues: import('./api.js').Issue[], goTo: (pointer: string) => void}} properties */
function Issues({issues, goTo}) {
  return html`<ul>${issues.slice(0, 20).map(({pointer, code, detail}) => html`<li><button class="link" onClick=${() => goTo(pointer)}><code>${pointer || '#'}</code></button>
    <span><strong>${code}</strong>: ${detail}</span></li>`)}</ul>`;
}

