/** Small parts that several pages use. */
import {signal, useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useLayoutEffect, useRef} from 'preact/hooks';
import {postJson, Problem, request} from './api.js';
import {figure} from './format.js';
import {heatColor} from './heat.js';
import {bells, setBells} from './store.js';
import {words} from './words.js';

/** Paths of 24 x 24 icons, drawn as lines. @type {Record<string, string>} */
const ICONS = {
  bell: 'M18 16V11a6 6 0 0 0-12 0v5l-2 2h16zM10 21h4',
  queue: 'M4 6h16M4 12h16M4 18h10', new: 'M4 20l4-1L19 8l-3-3L5 16zM14 7l3 3', batches: 'M4 4h7v7H4zM13 4h7v7h-7zM4 13h7v7H4zM13 13h7v7h-7z',
  system: 'M3 12h4l3-8 4 16 3-8h4', docs: 'M6 3h9l4 4v14H6zM14 3v5h5M9 13h7M9 17h7', theme: 'M12 3a9 9 0 1 0 0 18zM12 3a9 9 0 0 1 0 18',
  keys: 'M3 7h18v10H3zM7 11h.01M11 11h.01M15 11h.01M8 14h8', queued: 'M12 7v5l3 2M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18z', running: 'M8 5l11 7-11 7z',
  succeeded: 'M5 12.500l4.500 4.500L19 7.500', failed: 'M6 6l12 12M18 6L6 18', cancelled: 'M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18zM6 18L18 6',
};

/** @param {{name: string}} properties */
export function Icon({name}) {
  return html`<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" stroke-linejoin="round" aria-hidden="true"><path d=${ICONS[name]} /></svg>`;
}

/** @param {{state: 'queued' | 'running' | 'succeeded' | 'failed' | 'cancelled'}} properties */
export function State({state}) {
  return html`<span class="state" data-state=${state}><${Icon} name=${state} />${words.states[state]}</span>`;
}

/** Switches the bell of jobs. @param {{ids: string[], label: string}} properties */
export function Bell({ids, label}) {
  const on = ids.every((id) => bells.value.includes(id));
  return html`<button class="bell" aria-pressed=${on} aria-label=${label} title=${label} onClick=${() => setBells(ids, !on)}><${Icon} name="bell" /></button>`;
}

/** A failure in the server's own words. @param {{problem: Problem | null}} properties */
export function Failure({problem}) {
  if (!problem) return null;
  return html`<p class="note bad" role="alert">${problem.message} ${problem.requestId && html`<span class="dim">(request <code>${problem.requestId}</code>)</span>`}</p>`;
}

/** Requirements that are no part of a model: how it is made cheaper. */
const CHEAPER = ['interreflection', 'approximations'];

/** Features that the scene does not need, which cost nothing. @param {{requirements: Record<string, boolean>}} properties */
export function NotModelled({requirements}) {
  const absent = Object.entries(requirements || {}).filter(([name, needed]) => !needed && !CHEAPER.includes(name)).map(([name]) => name.replaceAll('_', ' '));
  return absent.length > 0 && html`<p class="dim">${words.job.notModelled}: ${absent.join(', ')}.</p>`;
}

/**
 * An input that is read when the user is done with it. It is written when its value changes and when it is left: neither a
 * render of the page, which a change of any job may cause, nor another value takes away what the user types.
 * @param {{value: string | number, field?: import('preact').RefObject<HTMLInputElement>, [attribute: string]: any}} properties
 */
export function Entry({value, field, onInput, onChange, ...attributes}) {
  const own = useRef(/** @type {HTMLInputElement | null} */ (null)), input = field ?? own;
  const isTyped = useRef(false);
  const write = () => {
    isTyped.current = false;
    if (input.current) input.current.value = String(value);
  };
  const typed = (/** @type {any} */ event) => { isTyped.current = true; onInput?.(event); };
  const read = (/** @type {any} */ event) => { isTyped.current = false; onChange?.(event); };
  useLayoutEffect(() => { if (!isTyped.current) write(); }, [value]);
  return html`<input ref=${input} onBlur=${write} onInput=${typed} onChange=${read} ...${attributes} />`;
}

/** Colours of heat maps with their values. @param {{white: number, unit: string}} properties */
export function HeatLegend({white, unit}) {
  const stops = Array.from({length: 9}, (_, i) => `rgb(${heatColor(i / 8).join(' ')})`).join(', ');
  return html`<div class="legend"><div style=${{background: `linear-gradient(to right, ${stops})`}}></div><div class="number"><span>0</span><span>${figure(white / 2)}</span><span>${figure(white)} ${unit}</span></div></div>`;
}

/** @param {{open: boolean, onClose: () => void, title: string, children?: any}} properties */
export function Dialog({open, onClose, title, children}) {
  const ref = useRef(/** @type {HTMLDialogElement | null} */ (null)), closings = useSignal(0);
  // The browser closes it on Esc even if the page has to keep it open.
  const closed = () => {
    if (ref.current?.open) return;
    onClose();
    ++closings.value;
  };
  useEffect(() => {
    if (open && !ref.current?.open) ref.current?.showModal();
    if (!open) ref.current?.close();
  }, [open, closings.value]);
  return html`<dialog ref=${ref} aria-label=${title} onClose=${closed}>${open && children}</dialog>`;
}

export const toast = signal('');
/** Route that the sentence links to; empty: none. */
export const toastRoute = signal('');
let toastTimer = 0;

/** Shows a sentence for some seconds, and to screen readers. @param {string} text @param {string} [to] the route of a link */
export function announce(text, to = '') {
  toast.value = text;
  toastRoute.value = to;
  clearTimeout(toastTimer);
  toastTimer = window.setTimeout(() => { toast.value = ''; }, 6000);
}

/** Runs an action of the user; a failure is shown. @param {() => Promise<void>} action */
export async function attempt(action) {
  try {
    await action();
  } catch (error) {
    if (!(error instanceof Problem)) throw error;
    announce(error.requestId ? `${error.message} (request ${error.requestId})` : error.message);
  }
}

/** Copies text, also where the clipboard is not available (plain HTTP on a network). @param {string} text */
export async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = document.createElement('textarea');
    area.value = text;
    document.body.append(area);
    area.select();
    const isCopied = document.execCommand('copy');
    area.remove();
    if (!isCopied) return announce(words.playground.notCopied);
  }
  announce(words.playground.copied);
}

/** A small image of a job, once it is in view. @param {{job: Record<string, any>, side?: number}} properties */
export function Thumbnail({job, side = 128}) {
  const hasImage = !job.expired && ((job.kind === 'render' && job.state === 'running') || (job.artifacts || []).some((/** @type {any} */ each) => each.media_type === 'image/png'));
  const step = job.state === 'running' ? Math.floor(job.progress * 4) : job.state;
  const box = useRef(/** @type {HTMLElement | null} */ (null));
  const url = useSignal(''), inView = useSignal(false);
  useEffect(() => {
    const observer = new IntersectionObserver((entries) => { if (entries.some((each) => each.isIntersecting)) inView.value = true; });
    if (box.current) observer.observe(box.current);
    return () => observer.disconnect();
  }, []);
  useEffect(() => {
    if (!hasImage || !inView.value) return;
    const controller = new AbortController();
    imageUrl(`/v1/jobs/${job.id}/preview?max=${side}`, controller.signal).then((made) => {
      if (!made) return;
      URL.revokeObjectURL(url.value);
      url.value = made;
    }, () => undefined);
    return () => controller.abort();
  }, [job.id, step, hasImage, inView.value]);
  useEffect(() => () => URL.revokeObjectURL(url.value), []);
  return html`<span class="thumb" ref=${box}>${url.value && html`<img class="thumb" src=${url.value} alt="" />`}</span>`;
}

const DOWNLOAD_IN_MEMORY_MAX = 8e6;

/** Saves the bytes at a path as a file: a large one by the browser itself, under a ticket. @param {string} path @param {string} name */
export async function download(path, name) {
  const stop = new AbortController(), reply = await request('GET', path, {signal: stop.signal});
  const isLarge = Number(reply.headers.get('Content-Length')) > DOWNLOAD_IN_MEMORY_MAX;
  if (isLarge) stop.abort();
  const url = isLarge ? (await postJson('/v1/tickets', {path})).url : URL.createObjectURL(await reply.blob());
  const link = document.createElement('a');
  link.href = url;
  link.download = name;
  link.click();
  if (!isLarge) setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** At most four images are requested at once. */
const IMAGES_AT_ONCE = 4;
let loading = 0;
/** @type {(() => void)[]} */
const waiting = [];

/** The bytes at a path as a blob URL; the key is sent. @param {string} path @param {AbortSignal} signal @returns {Promise<string>} empty: there are none */
export async function imageUrl(path, signal) {
  if (loading >= IMAGES_AT_ONCE) await new Promise((resolve) => waiting.push(() => resolve(undefined)));
  ++loading;
  try {
    if (signal.aborted) return '';
    const reply = await request('GET', path, {signal});
    return reply.status === 200 ? URL.createObjectURL(await reply.blob()) : '';
  } finally {
    --loading;
    waiting.shift()?.();
  }
}
