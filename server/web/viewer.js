/** An image with zoom, pan and pixel values; a second one may cover the right part of it. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {addKeys} from './keys.js';
import {FullScreen} from './parts.js';
import {words} from './words.js';

/** From SHARP on pixels are squares. An image that is fitted is smooth, and not larger than that. */
const ZOOM_MAX = 64, STEP = 1.25, SHARP = 3;
const text = words.viewer;

/** @param {number} byte */
const linear = (byte) => byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4;

/**
 * @typedef {object} Properties
 * @property {string} url of the image; empty: none yet
 * @property {string} alt
 * @property {{width: number, height: number} | null} size of the whole image, which a preview stands for
 * @property {string} [cover] of the image over its right part
 * @property {string} [coverAlt]
 * @property {string} [sides] names of both images, left and right
 * @property {(x: number, y: number) => string} [valueAt] what more is known of a pixel
 * @property {import('@preact/signals').Signal<{zoom: number, x: number, y: number}>} [view] zoom and place, to be shared; zoom 0: fits
 * @property {any} [children] shown without an image
 */

/** @param {Properties} properties */
export function Viewer({url, alt, size, cover, coverAlt, sides = text.wipe, valueAt, view: shared, children}) {
  const box = useRef(/** @type {HTMLElement | null} */ (null)), imageElement = useRef(/** @type {HTMLImageElement | null} */ (null));
  const own = useSignal({zoom: 0, x: 0, y: 0}), view = shared || own;
  const section = useRef(/** @type {HTMLElement | null} */ (null));
  const wipe = useSignal(50), resized = useSignal(0);
  const pixel = useSignal('');
  const width = size?.width || 1, height = size?.height || 1;
  const fit = () => Math.min(SHARP, (box.current?.clientWidth || 1) / width, (box.current?.clientHeight || 1) / height);

  /** Zooms about a point of the box. */
  const zoomBy = (/** @type {number} */ factor, x = (box.current?.clientWidth || 0) / 2, y = (box.current?.clientHeight || 0) / 2) => {
    const {zoom, x: left, y: top} = place();
    const next = Math.max(fit() / 4, Math.min(ZOOM_MAX, zoom * factor));
    view.value = {zoom: next, x: x - (x - left) * next / zoom, y: y - (y - top) * next / zoom};
  };
  /** Zoom and the corner of the image in the box. */
  const place = () => {
    if (view.value.zoom > 0) return view.value;
    const zoom = fit();
    return {zoom, x: ((box.current?.clientWidth || 0) - width * zoom) / 2, y: ((box.current?.clientHeight || 0) - height * zoom) / 2};
  };
  const toFit = () => { view.value = {zoom: 0, x: 0, y: 0}; };
  const toOne = () => { toFit(); zoomBy(1 / fit()); };
  useEffect(() => addKeys({'+': () => zoomBy(STEP), '-': () => zoomBy(1 / STEP), '0': toOne, 'f': toFit}), [width, height]);
  useEffect(() => {
    const element = box.current;
    const wheel = (/** @type {WheelEvent} */ event) => {
      event.preventDefault();
      const frame = /** @type {HTMLElement} */ (element).getBoundingClientRect();
      zoomBy(event.deltaY < 0 ? STEP : 1 / STEP, event.clientX - frame.left, event.clientY - frame.top);
    };
    element?.addEventListener('wheel', wheel, {passive: false});
    const observer = new ResizeObserver(() => { ++resized.value; });
    if (element) observer.observe(element);
    return () => { element?.removeEventListener('wheel', wheel); observer.disconnect(); };
  }, [width, height, url !== '']);

  const probe = (/** @type {PointerEvent} */ event) => {
    const frame = /** @type {HTMLElement} */ (box.current).getBoundingClientRect(), {zoom, x, y} = place();
    const column = Math.floor((event.clientX - frame.left - x) / zoom), row = Math.floor((event.clientY - frame.top - y) / zoom);
    pixel.value = column >= 0 && row >= 0 && column < width && row < height ? describe(column, row) : '';
  };
  const describe = (/** @type {number} */ column, /** @type {number} */ row) => {
    const image = imageElement.current, place = `x ${column}, y ${row}`;
    if (!image?.complete || image.naturalWidth === 0) return place;
    const canvas = new OffscreenCanvas(1, 1), context = canvas.getContext('2d');
    if (!context) return place;
    const scale = image.naturalWidth / width;
    context.drawImage(image, Math.floor(column * scale), Math.floor(row * scale), 1, 1, 0, 0, 1, 1);
    const [r, g, b] = context.getImageData(0, 0, 1, 1).data;
    const hex = [r, g, b].map((byte) => byte.toString(16).padStart(2, '0')).join('');
    return `${place}   #${hex}   ${[r, g, b].map((byte) => linear(byte).toFixed(3)).join(' ')}${valueAt ? '   ' + valueAt(column, row) : ''}`;
  };
  const drag = (/** @type {PointerEvent} */ down) => {
    if (down.button !== 0) return;
    const start = place(), element = /** @type {HTMLElement} */ (box.current);
    element.setPointerCapture(down.pointerId);
    element.onpointermove = (event) => { view.value = {zoom: start.zoom, x: start.x + event.clientX - down.clientX, y: start.y + event.clientY - down.clientY}; };
    element.onpointerup = element.onpointercancel = () => { element.onpointermove = element.onpointerup = null; };
  };

  resized.value;
  const {zoom, x, y} = place();
  const style = {width: `${width * zoom}px`, height: `${height * zoom}px`, transform: `translate(${x}px, ${y}px)`};
  const sharp = view.value.zoom >= SHARP ? 'sharp' : '';
  const edge = (/** @type {number} */ share) => `inset(0 0 0 ${share}%)`;
  return html`<section class="viewer" ref=${section} aria-label=${alt}>
    <div class="canvas" ref=${box} onPointerDown=${drag} onPointerMove=${probe} onPointerLeave=${() => { pixel.value = ''; }}>
      ${url ? html`<img ref=${imageElement} class=${sharp} style=${style} src=${url} alt=${alt} draggable=${false} />` : html`<div class="empty">${children}</div>`}
      ${url && cover && html`<img class=${sharp} style=${{...style, clipPath: edge(wipe.value)}} src=${cover} alt=${coverAlt} draggable=${false} data-cover="yes" />`}
    </div>
    <div class="caption">
      <span class="number" role="status">${pixel.value || (url ? matchMedia('(hover: none)').matches ? text.touchHint : text.hint : '')}</span><span class="spring"></span>
      ${cover && html`<label class="switch">${sides}<input type="range" min="0" max="100" value=${wipe.value} onInput=${(/** @type {any} */ event) => { wipe.value = Number(event.target.value); }} /></label>`}
      <span role="group" class="zoom"><button aria-label=${text.out} onClick=${() => zoomBy(1 / STEP)}>−</button>
        <button title=${text.one} onClick=${toOne}>1:1</button><button onClick=${toFit}>${text.fit}</button>
        <button aria-label=${text.in} onClick=${() => zoomBy(STEP)}>+</button>
        ${url && html`<span class="number dim">${Math.round(zoom * 100)} %</span>`}<${FullScreen} target=${section} /></span>
    </div>
  </section>`;
}
