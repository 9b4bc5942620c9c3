/** The playground: editor, image and facts of one document. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {getJson, mayWrite, postJson} from './api.js';
import {Drafts} from './draft.js';
import {Editor} from './editor.js';
import {Facts, Problems, Target, estimateText} from './facts.js';
import {duration, levels} from './format.js';
import {dollied, orbited, panned, rounded, viewOf} from './orbit.js';
import {storeText} from './job-source.js';
import {announce, attempt, copy, Dialog, Failure, FullScreen, Icon, Splitter} from './parts.js';
import {pick, placeIn} from './pick.js';
import {applied, changesTo, wholeRangeOf} from './pointers.js';
import {go, route, routeOf, setQuery} from './routes.js';
import {commands, FileButton, firstText, Gallery, linkTo, loadExamples, nameFiles, opened, openDocuments, textOfLink} from './scenes.js';
import {words} from './words.js';

const text = words.playground, STORED_FACTS = 'whittle.facts';

/** Pixels that a pointer moves in a click. */
const CLICK_MOVE_MAX = 3;
/** A press of an arrow key turns the view by radians, or moves it by parts of the height of the image. */
const KEY_TURN = Math.PI / 24, KEY_PAN = 0.05, DOLLY = 0.08, PAUSE_MS = 250;

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
    this.stepTimer = 0;
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
  wheel(event) { this.step(event, (view) => dollied(view, Math.exp(Math.sign(event.deltaY) * DOLLY))); }

  /** The arrow keys orbit, and pan with the shift key; + and - come closer and go back. @param {KeyboardEvent} event */
  press(event) {
    const [x, y] = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key] || [0, 0];
    const closer = {'+': -1, '-': 1}[event.key] || 0;
    if (event.ctrlKey || event.metaKey || event.altKey || (!x && !y && !closer)) return;
    this.step(event, (view) => closer ? dollied(view, Math.exp(closer * DOLLY))
      : event.shiftKey ? panned(view, x * KEY_PAN, y * KEY_PAN) : orbited(view, x * KEY_TURN, y * KEY_TURN));
  }

  /** A change of the view that has no end of its own. @param {Event} event @param {(view: import('./orbit.js').View) => import('./orbit.js').View} change */
  step(event, change) {
    if (!this.begin() || !this.view) return;
    event.preventDefault();
    event.stopPropagation();
    this.move(change(this.view));
    clearTimeout(this.stepTimer);
    this.stepTimer = window.setTimeout(() => this.end(), PAUSE_MS);
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
  const error = shown.error ? `, ${text.error} ${levels(shown.error.estimate)}` : '';
  return `${kind} ${shown.width} × ${shown.height}, ${duration(shown.milliseconds / 1000)}${error}`;
}

/** @param {{id: string}} properties */
export function Playground({id}) {
  const host = useRef(/** @type {HTMLElement | null} */ (null));
  const canvas = useRef(/** @type {HTMLElement | null} */ (null));
  const editor = useRef(/** @type {Editor | null} */ (null));
  const drafts = useSignal(/** @type {Drafts | null} */ (null));
  const failure = useSignal(/** @type {any} */ (null));

  useEffect(() => {
    let closed = false;
    /** @type {(() => void)[]} */
    const ends = [];
    (async () => {
      const [document, schema] = await Promise.all([firstText(id), getJson('/schemas/scene.schema.json')]);
      if (closed || !host.current || !canvas.current) return;
      if (!id) storeText('', document);  // a sweep takes it
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
        onSubmit: () => submit('/v1/jobs'),
        onDrop: (files, at) => openFiles(files, at),
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
      const ending = new AbortController(), {signal} = ending;
      box.addEventListener('pointerdown', (event) => camera.pointer(event), {signal});
      box.addEventListener('keydown', (event) => camera.press(event), {signal});
      box.addEventListener('wheel', (event) => camera.wheel(event), {signal, passive: false});
      window.addEventListener('keydown', (event) => {
        const [ctrl, isEnter] = [event.ctrlKey || event.metaKey, event.key === 'Enter' && !event.defaultPrevented && !globalThis.document.querySelector('dialog[open]')];
        if (!isEnter || ctrl === event.altKey || !mayWrite.value) return;
        event.preventDefault();
        ctrl ? submit('/v1/jobs') : draftNow();
      }, {signal});
      ends.push(() => { ending.abort(); made.close(); edit.destroy(); });
      drafts.value = made;
      made.edited(document);
      const accuracy = route.value.query.get('accuracy');
      if (accuracy) edit.change(changesTo(document, ['accuracy'], JSON.parse(accuracy)));
      const pointer = accuracy ? '/accuracy' : route.value.query.get('at');
      if (pointer) edit.goTo(pointer);
    })().catch((error) => { failure.value = error; });
    return () => { closed = true; ends.forEach((end) => end()); editor.current = null; };
  }, [id]);

  const busy = useSignal(false);
  const draftNow = () => { editor.current?.flush(); drafts.value?.now(); };
  const submit = (/** @type {string} */ path) => attempt(async () => {
    if (busy.value) return;
    busy.value = true;
    try {
      editor.current?.flush();
      const value = editor.current?.text() || '';
      go(routeOf(await postJson(path, path === '/v1/measure' ? `{"scene": ${value}}` : value)));
    } catch (error) {
      busy.value = false;
      throw error;
    }
  });
  /** Documents are opened, other files are uploaded and named in the text. @param {File[]} files @param {number} [at] */
  const openFiles = (files, at) => attempt(async () => {
    const others = await openDocuments(files);
    if (others.length > 0 && editor.current) await nameFiles(editor.current, others, at ?? editor.current.view.state.selection.main.head);
  });
  const {query} = route.value, example = query.get('example'), link = query.get('text');
  useEffect(() => {
    if (!drafts.value || (!example && !link && !opened.value)) return;
    const wanted = example ? loadExamples().then((known) => known[example]) : link ? textOfLink(link) : Promise.resolve(opened.value);
    opened.value = '';
    wanted.then((value) => {
      if (value) editor.current?.setText(value);
      else announce(text.badLink);
      setQuery({example: null, text: null});
    });
  }, [drafts.value, example, link, opened.value]);
  const showsFacts = useSignal(localStorage.getItem(STORED_FACTS) === 'open');
  const toggleFacts = () => { localStorage.setItem(STORED_FACTS, (showsFacts.value = !showsFacts.value) ? 'open' : ''); };
  return html`<div class=${`playground ${showsFacts.value ? 'with-facts' : ''}`}>
    <${Bar} id=${id} editor=${editor} drafts=${drafts} isBusy=${busy.value} submit=${submit} draftNow=${draftNow} openFiles=${openFiles} />
    <div class="edit" onDragOver=${(/** @type {Event} */ event) => event.preventDefault()} onDrop=${(/** @type {DragEvent} */ event) => { if (!event.defaultPrevented) { event.preventDefault(); openFiles([...(event.dataTransfer?.files || [])]); } }}>
      <${Failure} problem=${failure.value} /><div class="editor" ref=${host}></div><${Problems} drafts=${drafts} editor=${editor} /></div>
    <${Splitter} name="edit" isLeft label=${words.panes.editor} />
    <${Stage} box=${canvas} drafts=${drafts} editor=${editor}>
      <button class="quiet" aria-expanded=${showsFacts.value} onClick=${toggleFacts}>${text.facts} <${Icon} name="left" /></button></${Stage}>
    ${showsFacts.value && html`<${Facts} drafts=${drafts} editor=${editor} />`}
  </div>`;
}

/**
 * @param {{id: string, editor: {current: Editor | null}, drafts: import('@preact/signals').Signal<Drafts | null>, isBusy: boolean, submit: (path: string) => void,
 *   draftNow: () => void, openFiles: (files: File[]) => void}} properties
 */
function Bar({id, editor, drafts, isBusy, submit, draftNow, openFiles}) {
  const made = drafts.value, chooses = useSignal(false);
  const copyAs = (/** @type {string} */ name) => { if (name in commands) copy(commands[/** @type {'curl'} */ (name)](editor.current?.text() || '')); };
  const share = async () => {
    const link = await linkTo(editor.current?.text() || '');
    if (link) copy(link);
    else announce(text.tooLong);
  };
  const isOff = made?.validation.value?.valid === false || isBusy;
  // Not at the choice: an arrow key chooses, and the next one goes on from there.
  const reset = (/** @type {any} */ event) => { event.target.value = ''; };
  return html`<div class="bar">
    <h1 class="visually-hidden">${words.titles.new}</h1>
    ${made && mayWrite.value && html`<button onClick=${() => { chooses.value = true; }}>${text.examples}</button>
      <${FileButton} accept=".json,image/*,.exr,.hdr,.obj,.ply,.glb,.gltf" onFiles=${openFiles}>${words.scenes.open}</${FileButton}>`}
    <${Dialog} open=${chooses.value} onClose=${() => { chooses.value = false; }} title=${text.examples}><div class="stack" onClick=${(/** @type {any} */ event) => { if (event.target.closest('a')) chooses.value = false; }}>
      <h2>${text.examples}</h2><${Gallery} all /><div class="row"><button onClick=${() => { chooses.value = false; }}>${words.close}</button></div></div></${Dialog}>
    ${made && mayWrite.value && html`
      <label class="switch" title=${text.autoHelp}><input type="checkbox" checked=${made.auto.value} onChange=${() => made.setAuto(!made.auto.value)} />${text.auto}</label>
      <label class="switch" title=${text.refineHelp}><input type="checkbox" checked=${made.refine.value} onChange=${() => { made.refine.value = !made.refine.value; }} />${text.refine}</label>
      ${(!made.auto.value || made.manualReason.value) && html`<button onClick=${draftNow}>${text.draftNow} <kbd>${text.draftKey}</kbd></button>`}
      <${Target} editor=${editor} />`}
    <span class="spring"></span>
    <button title=${text.shareHelp} onClick=${share}>${text.share}</button>
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

/** @param {{box: {current: HTMLElement | null}, drafts: import('@preact/signals').Signal<Drafts | null>, editor: {current: Editor | null}, children?: any}} properties */
function Stage({box, drafts, editor, children}) {
  const made = drafts.value, stage = useRef(/** @type {HTMLElement | null} */ (null));
  const older = made?.older.value;
  const show = (/** @type {import('./draft.js').Shown | null} */ image) => { if (made) made.older.value = image; };
  const shown = older || made?.shown.value;
  const manual = made?.manualReason.value;
  const restore = () => {
    if (older) editor.current?.setText(older.text);
    show(null);
  };
  const isStale = !older && made?.validation.value?.valid === false;
  return html`<section class="stage" ref=${stage} aria-label=${words.titles.new}>
    ${manual && html`<p class="banner">${manual === 'size' ? text.manual.size : text.manual.time}</p>`}
    <div class=${`canvas ${isStale ? 'stale' : ''}`} ref=${box} title=${text.hint} tabindex="0" role="group" aria-label=${text.canvas}>
      ${shown ? html`<img class=${shown.kind === 'refined' ? '' : 'soft'} src=${shown.url} style=${{backgroundImage: shown.under ? `url(${shown.under})` : 'none'}} alt=${text.imageAlt} draggable=${false} data-kind=${shown.kind} data-job=${shown.job || ''} />`
        : html`<div class="empty"><h2>${text.waiting}</h2><p>${text.waitingText}</p></div>`}
    </div>
    <div class="caption">
      <span class="number" role="status">${older ? text.older + ': ' : isStale && shown ? text.stale + ': ' : ''}${shown ? caption(shown) : ''}</span>
      ${!older && shown && shown.kind !== 'refined' && made && html`<span class="number dim">${estimateText(made.validation.value?.estimate)}</span>`}
      <span class="spring"></span>
      ${older && html`<button onClick=${restore}>${text.restore}</button><button class="quiet" onClick=${() => show(null)}>${text.backToNow}</button>`}
      <${FullScreen} target=${stage} />${children}
    </div>
    <${Failure} problem=${made?.problem.value || null} />
    <div class="film" role="group" aria-label=${text.history}>
      ${made && made.history.value.length > 0 ? made.history.value.map((each) => html`<button key=${each.url} aria-pressed=${each === older} aria-label=${text.older}
          onClick=${() => show(each === older ? null : each)}><img src=${each.url} alt="" /></button>`)
        : html`<span class="dim">${text.historyEmpty}</span>`}
    </div>
  </section>`;
}
