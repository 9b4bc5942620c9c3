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
  missed: 'M12 4L2.500 20h19zM12 10v4M12 17h.01', full: 'M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5', left: 'M15 5l-7 7 7 7',
  succeeded: 'M5 12.500l4.500 4.500L19 7.500', failed: 'M6 6l12 12M18 6L6 18', cancelled: 'M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18zM6 18L18 6',
};

/** @param {{name: string}} properties */
export function Icon({name}) {
  return html`<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" stroke-linejoin="round" aria-hidden="true"><path d=${ICONS[name]} /></svg>`;
}

/** True if the render ended above an error that its document sets as a target. @param {any} job */
export const missedTarget = (job) => job?.report?.error?.met === false;

/** @param {{state: 'queued' | 'running' | 'succeeded' | 'failed' | 'cancelled', job?: any}} properties with the job, if it may have missed its target */
export function State({state, job}) {
  const shown = state === 'succeeded' && missedTarget(job) ? 'missed' : state;
  return html`<span class="state" data-state=${shown}><${Icon} name=${shown} /><span>${words.states[shown]}</span></span>`;
}

/** Shows a part of the page on the whole screen, and back. @param {{target: {current: HTMLElement | null}}} properties */
export function FullScreen({target}) {
  if (!document.fullscreenEnabled) return null;
  const toggle = () => document.fullscreenElement ? document.exitFullscreen() : target.current?.requestFullscreen();
  return html`<button class="icon" aria-label=${words.panes.full} title=${words.panes.full} onClick=${toggle}><${Icon} name="full" /></button>`;
}

const PANE_MIN = 260, PANE_STEP = 24;

/**
 * The line between two panes: it is dragged, or moved by the arrow keys. The width of the pane is kept as --pane of the grid.
 * @param {{name: string, isLeft?: boolean, label: string}} properties `isLeft`: the pane is left of the line
 */
export function Splitter({name, isLeft = false, label}) {
  const line = useRef(/** @type {HTMLElement | null} */ (null)), stored = `whittle.pane.${name}`, width = useSignal(0);
  const now = () => {
    const box = line.current?.getBoundingClientRect(), grid = line.current?.parentElement?.getBoundingClientRect();
    return !box || !grid ? 0 : isLeft ? box.left - grid.left : grid.right - box.right;
  };
  const set = (/** @type {number} */ wanted) => {
    const grid = line.current?.parentElement;
    if (!grid) return;
    const next = wanted && Math.round(Math.max(PANE_MIN, Math.min(grid.clientWidth - PANE_MIN, wanted)));
    if (next) grid.style.setProperty('--pane', `${next}px`);
    else grid.style.removeProperty('--pane');
    localStorage.setItem(stored, String(next));
    width.value = Math.round(now());
  };
  useLayoutEffect(() => { set(Number(localStorage.getItem(stored))); }, []);
  const drag = (/** @type {PointerEvent} */ down) => {
    const element = /** @type {HTMLElement} */ (line.current), start = now();
    element.setPointerCapture(down.pointerId);
    element.onpointermove = (event) => set(start + (event.clientX - down.clientX) * (isLeft ? 1 : -1));
    element.onpointerup = element.onpointercancel = () => { element.onpointermove = element.onpointerup = null; };
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (!/^Arrow(Left|Right)$/.test(event.key)) return;
    event.preventDefault();
    set(now() + ((event.key === 'ArrowRight') === isLeft ? PANE_STEP : -PANE_STEP));
  };
  return html`<div class="splitter" ref=${line} role="separator" tabindex="0" aria-orientation="vertical" aria-label=${label} title=${words.panes.help}
    aria-valuenow=${width.value} onPointerDown=${drag} onKeyDown=${press} onDblClick=${() => set(0)}></div>`;
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
  const has = (/** @type {string} */ type) => (job.artifacts || []).some((/** @type {any} */ each) => each.media_type === type), hasPng = has('image/png');
  const isView = !hasPng && has('image/x-exr');  // has no preview, but the service draws its layers
  const hasImage = !job.expired && job.kind !== 'measure' && ((job.kind === 'render' && job.state === 'running') || hasPng || isView);
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
    imageUrl(`/v1/jobs/${job.id}/${isView ? 'view.png' : 'preview'}?max=${side}`, controller.signal).then((made) => {
      if (!made) return;
      URL.revokeObjectURL(url.value);
      url.value = made;
    }, () => undefined);
    return () => controller.abort();
  }, [job.id, step, hasImage, inView.value]);
  useEffect(() => () => URL.revokeObjectURL(url.value), []);
  return html`<span class="thumb" ref=${box}>${url.value ? html`<img class="thumb" src=${url.value} alt="" />` : job.kind === 'measure' && html`<${Icon} name="system" />`}</span>`;
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
