/** The playground: editor, image and facts of one document. */
import {effect, useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useMemo, useRef} from 'preact/hooks';
import {getJson, mayWrite, postJson} from './api.js';
import {Drafts} from './draft.js';
import {Editor} from './editor.js';
import {Facts, Problems, Target, estimateText} from './facts.js';
import {duration, levels} from './format.js';
import {CameraDrag} from './orbit.js';
import {storeText} from './job-source.js';
import {announceFound, LiveButton, LiveCaption, LiveProblem, LiveSession} from './live/session.js';
import {announce, attempt, copy, Dialog, Failure, FullScreen, Icon, Splitter} from './parts.js';
import {pick, placeIn} from './pick.js';
import {changesTo} from './pointers.js';
import {go, route, routeOf, setQuery} from './routes.js';
import {commands, FileButton, firstText, Gallery, linkTo, loadExamples, nameFiles, opened, openDocuments, textOfLink} from './scenes.js';
import {words} from './words.js';

const text = words.playground, STORED_FACTS = 'whittle.facts';

/** @param {import('./draft.js').Shown} shown */
function caption(shown) {
  const kind = {draft: text.draft, refining: text.refining, refined: text.refined}[shown.kind];
  const error = shown.error ? `, ${text.error} ${levels(shown.error.estimate)}` : '';
  return `${kind} ${shown.width} × ${shown.height}, ${duration(shown.milliseconds / 1000)}${error}`;
}

/**
 * Selects the text of what the live view shows at a place, and of its material; or puts it into focus.
 * @param {Editor} edit @param {ReturnType<LiveSession['pick']>} found @param {boolean} isFocus
 */
function goToLive(edit, found, isFocus) {
  if (found && isFocus) return edit.change(changesTo(edit.text(), ['camera', 'focus_distance'], Number(found.depth.toPrecision(4))));
  if (found?.object) edit.select([found.object, found.material]);
  announceFound(found);
}

/** @param {{id: string}} properties */
export function Playground({id}) {
  const host = useRef(/** @type {HTMLElement | null} */ (null));
  const canvas = useRef(/** @type {HTMLElement | null} */ (null));
  const editor = useRef(/** @type {Editor | null} */ (null));
  const drafts = useSignal(/** @type {Drafts | null} */ (null));
  const failure = useSignal(/** @type {any} */ (null));
  const live = useMemo(() => new LiveSession(), [id]);

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
          if (!made.dragging) live.edited(value);
        },
        onSubmit: () => submit('/v1/jobs'),
        onDrop: (files, at) => openFiles(files, at),
      });
      edit.setSchema(schema);
      const box = canvas.current;
      const goToObject = (/** @type {PointerEvent} */ event) => attempt(async () => {
        const found = live.on.value ? live.pick(event) : undefined;
        if (found !== undefined) return goToLive(edit, found, event.altKey);
        const shown = made.shown.value, image = box.querySelector('img');
        // An image of an earlier text, or of a window of the image, has other objects in its places.
        if (!mayWrite.value || !shown || image?.src !== shown.url || !made.validation.value?.valid) return;
        const scene = JSON.parse(edit.text()), place = placeIn(image, event);
        if (!place || (scene.image?.crop && shown.kind !== 'draft')) return;
        const pointer = await pick(scene, place, made.size);
        if (pointer) edit.goTo(pointer);
        else announce(text.background);
      });
      const camera = new CameraDrag(edit, {
        beginDrag: () => made.beginDrag(), viewed: (view) => live.viewed(view), endDrag: () => { made.endDrag(); live.edited(edit.text()); },
      }, goToObject);
      const ending = new AbortController(), {signal} = ending;
      camera.listen(box, signal);
      window.addEventListener('keydown', (event) => {
        const [ctrl, isEnter] = [event.ctrlKey || event.metaKey, event.key === 'Enter' && !event.defaultPrevented && !globalThis.document.querySelector('dialog[open]')];
        if (!isEnter || ctrl === event.altKey || !mayWrite.value) return;
        event.preventDefault();
        ctrl ? submit('/v1/jobs') : draftNow();
      }, {signal});
      const follow = effect(() => {
        made.isLive = live.on.value;
        const image = made.shown.value;
        if (image && image.kind !== 'refining') live.compare(image.url, image.text);
      });
      ends.push(() => { ending.abort(); follow(); live.set(false, '', null); made.close(); edit.destroy(); });
      drafts.value = made;
      made.edited(document);
      const accuracy = route.value.query.get('accuracy');
      if (accuracy) edit.change(changesTo(document, ['accuracy'], JSON.parse(accuracy)));
      const pointer = accuracy ? '/accuracy' : route.value.query.get('at');
      if (pointer) edit.goTo(pointer);
      if (route.value.query.get('live') && mayWrite.value) live.set(true, edit.text(), box.querySelector('.live'));
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
  const toggleLive = () => live.set(!live.on.value, editor.current?.text() || '', canvas.current?.querySelector('.live') || null);
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
    <${Bar} id=${id} editor=${editor} drafts=${drafts} live=${live} isBusy=${busy.value} submit=${submit} draftNow=${draftNow} toggleLive=${toggleLive} openFiles=${openFiles} />
    <div class="edit" onDragOver=${(/** @type {Event} */ event) => event.preventDefault()} onDrop=${(/** @type {DragEvent} */ event) => { if (!event.defaultPrevented) { event.preventDefault(); openFiles([...(event.dataTransfer?.files || [])]); } }}>
      <${Failure} problem=${failure.value} /><div class="editor" ref=${host}></div><${Problems} drafts=${drafts} editor=${editor} /></div>
    <${Splitter} name="edit" isLeft label=${words.panes.editor} />
    <${Stage} box=${canvas} drafts=${drafts} editor=${editor} live=${live}>
      <button class="quiet" aria-expanded=${showsFacts.value} onClick=${toggleFacts}>${text.facts} <${Icon} name="left" /></button></${Stage}>
    ${showsFacts.value && html`<${Facts} drafts=${drafts} editor=${editor} />`}
  </div>`;
}

/**
 * @param {{id: string, editor: {current: Editor | null}, drafts: import('@preact/signals').Signal<Drafts | null>, live: LiveSession, isBusy: boolean,
 *   submit: (path: string) => void, draftNow: () => void, toggleLive: () => void, openFiles: (files: File[]) => void}} properties
 */
function Bar({id, editor, drafts, live, isBusy, submit, draftNow, toggleLive, openFiles}) {
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
      <${LiveButton} isOn=${live.on.value} toggle=${toggleLive} />
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

/** @param {{box: {current: HTMLElement | null}, drafts: import('@preact/signals').Signal<Drafts | null>, editor: {current: Editor | null}, live: LiveSession, children?: any}} properties */
function Stage({box, drafts, editor, live, children}) {
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
    <${LiveProblem} live=${live} />
    <div class=${`canvas ${isStale ? 'stale' : ''}`} ref=${box} title=${live.on.value ? words.live.hint : text.hint} tabindex="0" role="group" aria-label=${text.canvas}>
      <div class="live" hidden=${!!older}></div>
      ${shown ? html`<img class=${shown.kind === 'refined' ? '' : 'soft'} src=${shown.url} style=${{backgroundImage: shown.under ? `url(${shown.under})` : 'none'}} alt=${text.imageAlt} draggable=${false} data-kind=${shown.kind} data-job=${shown.job || ''} />`
        : html`<div class="empty"><h2>${text.waiting}</h2><p>${text.waitingText}</p></div>`}
    </div>
    <div class="caption">
      ${live.on.value && !older ? html`<${LiveCaption} live=${live} goTo=${(/** @type {string} */ pointer) => editor.current?.goTo(pointer)} />`
        : html`<span class="number" role="status">${older ? text.older + ': ' : isStale && shown ? text.stale + ': ' : ''}${shown ? caption(shown) : ''}</span>`}
      ${!older && !live.on.value && shown && shown.kind !== 'refined' && made && html`<span class="number dim">${estimateText(made.validation.value?.estimate)}</span>`}
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
