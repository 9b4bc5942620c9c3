/** The editor of scene documents: CodeMirror within a shadow root, where its style sheets need no exception of the page's policy. */
import {autocompletion, closeBrackets, closeBracketsKeymap, completionKeymap, snippetCompletion} from '@codemirror/autocomplete';
import {defaultKeymap, history, historyKeymap, indentWithTab, isolateHistory} from '@codemirror/commands';
import {json} from '@codemirror/lang-json';
import {bracketMatching, codeFolding, foldGutter, HighlightStyle, indentOnInput, indentUnit, syntaxHighlighting} from '@codemirror/language';
import {lintGutter, lintKeymap, setDiagnostics} from '@codemirror/lint';
import {highlightSelectionMatches, searchKeymap} from '@codemirror/search';
import {Compartment, EditorSelection, EditorState, Transaction} from '@codemirror/state';
import {drawSelection, EditorView, highlightActiveLine, hoverTooltip, keymap, lineNumbers} from '@codemirror/view';
import {tags} from '@lezer/highlight';
import {rangeOf, segments, wholeRangeOf} from './pointers.js';
import {swatches} from './swatches.js';
import {words} from './words.js';
import {Caller} from './workers.js';

/** @typedef {import('./api.js').Issue} Issue */
/** @typedef {{from: number, to: number, message: string, severity: 'error' | 'warning', code?: string, pointer?: string}} Found */

const theme = EditorView.theme({
  '&': {height: '100%', fontSize: '13px', backgroundColor: 'var(--panel)', color: 'var(--text)'},
  '.cm-content': {fontFamily: 'var(--mono)', caretColor: 'var(--text)', padding: '8px 0', lineHeight: '1.55'},
  '.cm-scroller': {overflow: 'auto', fontFamily: 'var(--mono)'},
  '&.cm-focused': {outline: '2px solid var(--focus)', outlineOffset: '-2px'},
  '.cm-gutters': {backgroundColor: 'var(--panel)', color: 'var(--dim)', border: 'none'},
  '.cm-activeLine, .cm-activeLineGutter': {backgroundColor: 'color-mix(in srgb, var(--text) 6%, transparent)'},
  '&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground':
    {backgroundColor: 'color-mix(in srgb, var(--focus) 35%, transparent) !important'},
  '.cm-cursor': {borderLeftColor: 'var(--text)'},
  '.cm-tooltip': {backgroundColor: 'var(--raised)', color: 'var(--text)', border: '1px solid var(--line)', borderRadius: '6px', maxWidth: '420px'},
  '.cm-tooltip-autocomplete > ul > li[aria-selected]': {backgroundColor: 'var(--focus)', color: 'var(--on-focus)'},
  '.cm-completionInfo': {padding: '6px 10px', whiteSpace: 'pre-wrap'},
  '.cm-hover': {padding: '6px 10px', whiteSpace: 'pre-wrap', fontSize: '12px'},
  '.cm-diagnostic': {padding: '6px 10px', fontFamily: 'var(--sans)'},
  // Drawn without images of data: addresses, which the page's policy refuses.
  '.cm-lintRange': {backgroundImage: 'none !important', textDecoration: 'underline wavy 1px', textUnderlineOffset: '3px'},
  '.cm-lintRange-error': {textDecorationColor: 'var(--bad)'},
  '.cm-lintRange-warning': {textDecorationColor: 'var(--brand)'},
  '.cm-lint-marker': {content: 'none !important', width: '10px', height: '10px', margin: '5px 0 0 2px', borderRadius: '50%'},
  '.cm-lint-marker-error': {backgroundColor: 'var(--bad)'},
  '.cm-lint-marker-warning': {backgroundColor: 'var(--brand)', borderRadius: '0'},
  '.cm-panels': {backgroundColor: 'var(--raised)', color: 'var(--text)', borderColor: 'var(--line)'},
  '.cm-panels input, .cm-panels button': {font: 'inherit', color: 'inherit', background: 'var(--panel)', border: '1px solid var(--line)', borderRadius: '4px'},
  '.cm-matchingBracket': {backgroundColor: 'color-mix(in srgb, var(--ok) 30%, transparent) !important'},
  '.cm-swatch': {width: '14px', height: '14px', padding: '0', margin: '0 4px 0 2px', border: '1px solid var(--dim)', borderRadius: '3px', verticalAlign: '-2px', background: 'none', cursor: 'pointer'},
  '.cm-swatch::-webkit-color-swatch-wrapper': {padding: '0'},
  '.cm-swatch::-webkit-color-swatch': {border: 'none', borderRadius: '2px'},
  '.cm-handle': {display: 'inline-block', padding: '0 4px', margin: '0 2px', borderRadius: '3px', background: 'var(--line)', color: 'var(--text)', cursor: 'ew-resize', touchAction: 'none', userSelect: 'none'},
});

const colors = HighlightStyle.define([
  {tag: tags.propertyName, color: 'var(--code-name)'},
  {tag: tags.string, color: 'var(--code-string)'},
  {tag: tags.number, color: 'var(--code-number)'},
  {tag: [tags.bool, tags.null], color: 'var(--code-word)'},
]);

/** Longer texts have no colours, wrapped lines or other work of every key: those took 0.1 s a key at 6 MB. */
export const LARGE_TEXT = 1_000_000;
const LARGE_PAUSE_MS = 300;
/** @param {import('@codemirror/state').Text} text */
const isLarge = (text) => text.length > LARGE_TEXT;

/** Kinds of the language server protocol. @type {Record<number, string>} */
const COMPLETION_KINDS = {10: 'property', 12: 'constant', 13: 'enum', 14: 'keyword', 16: 'variable'};

/** Inserts "$1" of the protocol's snippets as CodeMirror's "${1}". @param {string} text */
const snippetOf = (text) => text.replace(/\$(\d+)/g, (_, index) => '${' + index + '}').replace(/\$\{(\d+):([^}]*)\}/g, '$${$1:$2}');

/** @param {Caller} service @returns {import('@codemirror/autocomplete').CompletionSource} */
function schemaCompletions(service) {
  return async (context) => {
    const typed = context.matchBefore(/[\w$"./-]+/);
    if (!context.explicit && (!typed || isLarge(context.state.doc))) return null;
    const items = await service.call({method: 'complete', text: context.state.doc.toString(), offset: context.pos});
    if (context.aborted || items.length === 0) return null;
    const from = Math.min(...items.map((/** @type {Found} */ item) => item.from));
    return {
      from, to: context.pos, validFor: /^[\w$"./-]*$/,
      options: items.map((/** @type {any} */ item) => snippetCompletion(snippetOf(item.text), {
        label: item.text.startsWith('"') && context.state.sliceDoc(from, from + 1) === '"' ? `"${item.label.replaceAll('"', '')}"` : item.label,
        displayLabel: item.label, type: COMPLETION_KINDS[item.kind], info: item.info || undefined,
      })),
    };
  };
}

/** A read-only editor has no completion, no notes and no worker for them. */
export class Editor {
  /**
   * @param {HTMLElement} host
   * @param {{text: string, readOnly?: boolean, onChange?: (text: string) => void, onSubmit?: () => void, onDrop?: (files: File[], at: number) => void}} options
   */
  constructor(host, {text, readOnly = false, onChange, onSubmit, onDrop}) {
    const root = host.shadowRoot || host.attachShadow({mode: 'open'});
    root.replaceChildren();
    this.service = readOnly ? undefined : new Caller('schema-worker.js');
    this.pause = 0;
    this.onChange = onChange;
    /** Places that move with the text around them. @type {{at: number}[]} */
    this.places = [];
    const extensions = [
      lineNumbers(), history(), drawSelection(), closeBrackets(), highlightActiveLine(), indentUnit.of('  '), theme, lintGutter(),
      this.helps(text.length > LARGE_TEXT, readOnly), EditorView.contentAttributes.of({'aria-label': words.editor.label, tabindex: '0'}),
      EditorState.readOnly.of(readOnly), EditorState.allowMultipleSelections.of(true),
      keymap.of([{key: 'Mod-Enter', run: () => { this.flush(); onSubmit?.(); return true; }}, ...closeBracketsKeymap, ...defaultKeymap, ...searchKeymap,
                 ...historyKeymap, ...completionKeymap, ...lintKeymap, indentWithTab]),
      EditorView.updateListener.of((update) => {
        if (!update.docChanged) return;
        for (const place of this.places) place.at = update.changes.mapPos(place.at);
        this.changed();
      }),
    ];
    if (this.service) {
      extensions.push(
        autocompletion({override: [schemaCompletions(this.service)], activateOnTyping: true}),
        EditorView.domEventHandlers({drop: (event, view) => this.dropped(event, view, onDrop)}));
    }
    this.view = new EditorView({state: EditorState.create({doc: text, extensions}), parent: root, root});
  }

  /** Extensions that a large text goes without, from the change on that makes it large. @param {boolean} large @param {boolean} readOnly @returns {import('@codemirror/state').Extension} */
  helps(large, readOnly) {
    const compartment = new Compartment();
    const own = readOnly ? [] : [swatches(), hoverTooltip(async (view, at) => this.hover(view, at))];
    const all = [foldGutter(), codeFolding(), indentOnInput(), bracketMatching(), highlightSelectionMatches(), json(), syntaxHighlighting(colors), EditorView.lineWrapping, ...own];
    return [compartment.of(large ? [] : all), EditorState.transactionExtender.of(({docChanged, newDoc, startState}) =>
      docChanged && isLarge(newDoc) !== isLarge(startState.doc) ? {effects: compartment.reconfigure(isLarge(newDoc) ? [] : all)} : null)];
  }

  /** @param {object} schema */
  setSchema(schema) { this.service?.worker.postMessage({schema}); }

  changed() {
    clearTimeout(this.pause);
    this.pause = isLarge(this.view.state.doc) ? window.setTimeout(() => this.flush(), LARGE_PAUSE_MS) : 0;
    if (this.pause === 0) this.onChange?.(this.text());
  }

  /** Passes on a change of a large text, which otherwise waits for a pause. */
  flush() {
    if (this.pause) this.onChange?.(this.text());
    clearTimeout(this.pause);
    this.pause = 0;
  }

  text() { return this.view.state.doc.toString(); }

  /** A place in the text, wherever changes move it. @param {number} at */
  follow(at) {
    const place = {at};
    this.places.push(place);
    return place;
  }

  /** Replaces everything, as one step that can be undone. @param {string} text */
  setText(text) {
    this.view.dispatch({changes: {from: 0, to: this.view.state.doc.length, insert: text}, annotations: isolateHistory.of('full')});
  }

  /** @param {import('./pointers.js').Change[]} changes @param {boolean} undoable */
  change(changes, undoable = true) {
    this.view.dispatch({changes, annotations: undoable ? isolateHistory.of('full') : Transaction.addToHistory.of(false)});
  }

  /** Problems of the language service, until the server's own replace them. @returns {Promise<Found[]>} */
  async lint() {
    const text = this.text();
    /** @type {{from: number, to: number, message: string, severity: number}[]} */
    const found = await this.service?.call({method: 'lint', text}) || [];
    if (text === this.text()) this.show(found.map((each) => ({...each, severity: each.severity === 1 ? 'error' : 'warning'})));
    return [];
  }

  /** Problems of the server at their pointers. @param {Issue[]} errors @param {Issue[]} warnings */
  showIssues(errors, warnings) {
    const text = this.text();
    /** @param {'error' | 'warning'} severity @returns {(issue: Issue) => Found} */
    const found = (severity) => ({pointer, code, detail}) => ({...rangeOf(text, pointer), message: `${code}: ${detail}`, severity, code, pointer});
    this.show([...errors.map(found('error')), ...warnings.map(found('warning'))]);
  }

  /** @param {Found[]} found */
  show(found) {
    this.found = found;
    const end = this.view.state.doc.length;
    this.view.dispatch(setDiagnostics(this.view.state, found.map((each) => (
      {from: Math.min(each.from, end), to: Math.min(Math.max(each.to, each.from + 1), end), severity: each.severity, message: each.message}))));
  }

  /** Puts the cursor on the value at a pointer. @param {string} pointer */
  goTo(pointer) {
    const {from} = rangeOf(this.text(), pointer);
    this.view.dispatch({selection: {anchor: from}, effects: EditorView.scrollIntoView(from, {y: 'center'})});
    this.view.focus();
  }

  /** Selects the values at pointers; the first one is shown. @param {string[]} pointers */
  select(pointers) {
    const text = this.text(), found = pointers.flatMap((pointer) => wholeRangeOf(text, segments(pointer)) || []);
    if (found.length === 0) return;
    const ranges = found.map(({from, to}) => EditorSelection.range(from, to));
    this.view.dispatch({selection: EditorSelection.create(ranges, 0), effects: EditorView.scrollIntoView(ranges[0].from, {y: 'center'})});
  }

  /** @param {EditorView} view @param {number} at */
  async hover(view, at) {
    const text = await this.service?.call({method: 'hover', text: view.state.doc.toString(), offset: at});
    if (!text) return null;
    return {pos: at, create: () => {
      const dom = document.createElement('div');
      dom.className = 'cm-hover';
      dom.textContent = text.replaceAll('\\', '');
      return {dom};
    }};
  }

  /** @param {DragEvent} event @param {EditorView} view @param {((files: File[], at: number) => void) | undefined} onDrop */
  dropped(event, view, onDrop) {
    const files = [...(event.dataTransfer?.files || [])];
    if (files.length === 0 || !onDrop) return false;
    event.preventDefault();
    onDrop(files, view.posAtCoords({x: event.clientX, y: event.clientY}) ?? view.state.selection.main.head);
    return true;
  }

  destroy() {
    this.flush();
    this.view.destroy();
    this.service?.stop();
  }
}
