/** The images of a batch one after the other. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {request} from './api.js';
import {addKeys} from './keys.js';
import {Entry} from './parts.js';
import {words} from './words.js';

const AHEAD = 8, FPS_MAX = 60;
const text = words.player;

/** Decoded images around the one that is shown. */
class Frames {
  /** @param {string[]} urls @param {(index: number) => void} decoded */
  constructor(urls, decoded) {
    this.urls = urls;
    this.decoded = decoded;
    /** Null while it is decoded. @type {Map<number, ImageBitmap | null>} */
    this.bitmaps = new Map();
    this.closing = new AbortController();
  }

  /** Decodes an image and those after it, and drops the others. @param {number} index */
  prefetch(index) {
    const wanted = new Set(Array.from({length: Math.min(AHEAD + 1, this.urls.length)}, (_, i) => (index + i) % this.urls.length));
    for (const [at, bitmap] of this.bitmaps) {
      if (wanted.has(at)) continue;
      bitmap?.close();
      this.bitmaps.delete(at);
    }
    for (const at of wanted) if (!this.bitmaps.has(at)) this.decode(at);
  }

  /** @param {number} at */
  async decode(at) {
    this.bitmaps.set(at, null);
    try {
      const bitmap = await createImageBitmap(await (await request('GET', this.urls[at], {signal: this.closing.signal})).blob());
      if (this.closing.signal.aborted || !this.bitmaps.has(at)) return bitmap.close();
      this.bitmaps.set(at, bitmap);
      this.decoded(at);
    } catch {
      // The one before stays; prefetch() requests it again.
      this.bitmaps.delete(at);
    }
  }

  close() {
    this.closing.abort();
    for (const bitmap of this.bitmaps.values()) bitmap?.close();
    this.bitmaps.clear();
  }
}

/** @param {{urls: string[], fps: import('@preact/signals').Signal<number>, size: {width: number, height: number}}} properties the images in their order */
export function Player({urls, fps, size}) {
  const index = useSignal(0), plays = useSignal(false), canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const frames = useRef(/** @type {Frames | null} */ (null)), late = useSignal(0);
  const draw = (/** @type {number} */ at) => {
    const bitmap = frames.current?.bitmaps.get(at), element = canvas.current;
    if (!bitmap || !element || at !== index.value) return;
    if (element.width !== bitmap.width || element.height !== bitmap.height) Object.assign(element, {width: bitmap.width, height: bitmap.height});
    element.getContext('2d')?.drawImage(bitmap, 0, 0);
    element.dataset.shown = String(at);
  };
  const show = (/** @type {number} */ at) => {
    index.value = (at + urls.length) % urls.length;
    frames.current?.prefetch(index.value);
    draw(index.value);
  };
  const step = (/** @type {number} */ by) => { plays.value = false; show(index.value + by); };
  useEffect(() => {
    frames.current = new Frames(urls, draw);
    show(Math.min(index.value, urls.length - 1));
    return () => frames.current?.close();
  }, [urls.join()]);
  useEffect(() => {
    if (!plays.value) return;
    late.value = 0;
    let frame = 0, shownAt = performance.now();
    const tick = (/** @type {number} */ now) => {
      const due = Math.floor((now - shownAt) * fps.value / 1000), next = (index.value + 1) % urls.length;
      if (due >= 1 && frames.current?.bitmaps.get(next)) {
        late.value += due - 1;
        shownAt += 1000 * due / fps.value;
        show(index.value + due);
      } else frames.current?.prefetch(index.value);
      frame = requestAnimationFrame(tick);
    };
    frame = requestAnimationFrame(tick);
    return () => cancelAnimationFrame(frame);
  }, [plays.value, fps.value, urls.join()]);
  const toggle = () => { plays.value = !plays.value; };
  useEffect(() => addKeys({' ': toggle, ',': () => step(-1), '.': () => step(1)}), [urls.join()]);
  const middle = Math.floor((urls.length - 1) / 2);
  return html`<section class="panel player" aria-label=${text.title}>
    <canvas ref=${canvas} role="img" aria-label=${text.image(index.value)} style=${{aspectRatio: `${size.width} / ${size.height}`}} data-dropped=${late.value}></canvas>
    <input type="range" min="0" max=${urls.length - 1} value=${index.value} aria-label=${text.place} onInput=${(/** @type {any} */ event) => { plays.value = false; show(Number(event.target.value)); }} />
    <div class="buttons"><button class="primary" onClick=${toggle}>${plays.value ? words.compare.pause : words.compare.play}</button>
      <button aria-label=${text.previous} title=${text.previous} onClick=${() => step(-1)}>‹</button><button aria-label=${text.next} title=${text.next} onClick=${() => step(1)}>›</button>
      <span class="number">${index.value + 1} / ${urls.length}</span><span class="spring"></span>
      ${urls.length > 2 && [['first', 0], ['middle', middle], ['last', urls.length - 1]].map(([name, at]) => html`<button onClick=${() => step(Number(at) - index.value)}>${text[/** @type {'first'} */ (name)]}</button>`)}
      <label class="switch"><${Entry} type="number" class="fps" min="1" max=${FPS_MAX} value=${fps.value} onChange=${(/** @type {any} */ event) => { fps.value = Math.max(1, Math.min(FPS_MAX, Math.round(Number(event.target.value)) || 1)); event.target.value = fps.value; }} /> ${text.fps}</label></div>
    ${late.value > 0 && html`<p class="dim">${text.dropped(late.value)}</p>`}
  </section>`;
}
