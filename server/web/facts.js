/** The document of the playground: its problems, its cost, its needs, its target. */
import {useComputed} from '@preact/signals';
import {html} from 'htm/preact';
import {count, duration, size} from './format.js';
import {Entry, NotModelled} from './parts.js';
import {changesTo} from './pointers.js';
import {words} from './words.js';

const text = words.playground;

/** @typedef {import('./draft.js').Drafts} Drafts */
/** @typedef {import('./editor.js').Editor} Editor */

/** The cost of the document itself. @param {any} estimate */
export const estimateText = (estimate) => estimate?.seconds ? text.costs(duration(estimate.seconds)) : '';

/** Errors and warnings of the document, under its text. @param {{drafts: import('@preact/signals').Signal<Drafts | null>, editor: {current: Editor | null}}} properties */
export function Problems({drafts, editor}) {
  const validation = useComputed(() => drafts.value?.validation.value || null).value;
  const goTo = (/** @type {string} */ pointer) => editor.current?.goTo(pointer);
  const {errors = [], warnings = []} = validation || {};
  return errors.length + warnings.length > 0 && html`<aside class="problems" aria-label=${text.problems}>
    ${errors.length > 0 && html`<section><h2>${text.invalid(errors.length)}</h2><${Issues} issues=${errors} goTo=${goTo} /></section>`}
    ${warnings.length > 0 && html`<section><h2>${text.warnings}</h2><${Issues} issues=${warnings} goTo=${goTo} /></section>`}</aside>`;
}

/** @param {{drafts: import('@preact/signals').Signal<Drafts | null>, editor: {current: Editor | null}}} properties */
export function Facts({drafts, editor}) {
  const validation = useComputed(() => drafts.value?.validation.value || null).value;
  const goTo = (/** @type {string} */ pointer) => editor.current?.goTo(pointer);
  if (!validation) return html`<aside class="facts" aria-label=${text.facts}></aside>`;
  const {estimate} = validation;
  const reasons = Object.entries(validation.reasons || {});
  return html`<aside class="facts" aria-label=${text.facts}>
    ${!validation.valid && html`<p class="dim">${text.invalid(validation.errors.length)}</p>`}
    ${estimate && html`<section><h2>${text.estimate}</h2><dl>
      <dt>${text.seconds}</dt><dd class="number">${estimate.seconds === null ? text.notYet : '≈ ' + duration(estimate.seconds)}</dd>
      <dt>${text.samples}</dt><dd class="number">${count(estimate.samples)}</dd>
      <dt>${text.memory}</dt><dd class="number">${size(estimate.memory_bytes)}</dd></dl></section>`}
    ${validation.valid && html`<section><h2>${text.needs}</h2>${reasons.length === 0 ? html`<p class="dim">${text.noReasons}</p>` : html`<ul>${reasons.map(([name, pointer]) => html`
      <li>${name.replaceAll('_', ' ')} <button class="link" onClick=${() => goTo(String(pointer))}><code>${String(pointer)}</code></button></li>`)}</ul>`}<${NotModelled} requirements=${validation.requirements} /><p class="dim">${text.globalLight(validation.global_light || '')}</p></section>`}
  </aside>`;
}

/** The target error of the document, and a field to change it. @param {{editor: {current: Editor | null}}} properties */
export function Target({editor}) {
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

