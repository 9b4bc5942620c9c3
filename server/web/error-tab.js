/** The account of a job's error: its parts as shares of the squared error, and maps of the layers that the EXR has. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect} from 'preact/hooks';
import {getJson, mayWrite, postJson, request} from './api.js';
import {figure} from './format.js';
import {announce, attempt, Entry, HeatLegend} from './parts.js';
import {go} from './routes.js';
import {Caller} from './workers.js';
import {words} from './words.js';

const text = words.error;

/** @typedef {{url: string, valueAt: (x: number, y: number) => string}} Heat */
/** @typedef {{name: 'sampling' | 'truncation' | 'approximation', levels: number, share: number}} Part */

/**
 * Shares of the squared error. Truncation is the rest beside sampling and approximation: its causes overlap, so they are not added.
 * @param {{estimate: number, parts: Record<string, number>}} error @returns {Part[]}
 */
export function shares({estimate, parts}) {
  const sampling = parts.sampling ** 2, approximation = parts.approximation ** 2;
  const truncation = Math.max(0, estimate ** 2 - sampling - approximation);
  const total = sampling + truncation + approximation || 1;
  return [
    {name: 'sampling', levels: parts.sampling, share: sampling / total},
    {name: 'truncation', levels: Math.sqrt(truncation), share: truncation / total},
    {name: 'approximation', levels: parts.approximation, share: approximation / total},
  ];
}

/** Levels that are white: as `whittle diff --heat`, which doubles 1 until it is 8 times the error. @param {number} estimate */
function defaultWhite(estimate) {
  let levels = 1;
  while (levels < 256 && levels < 8 * estimate) levels *= 2;
  return levels;
}

/** @param {{job: Record<string, any>}} properties */
export function ErrorTab({job}) {
  const error = job.report?.error;
  if (!error) return html`<p class="dim">${words.job.notYet}</p>`;
  const parts = shares(error), percent = (/** @type {number} */ share) => `${(100 * share).toFixed(1)} %`;
  return html`<section>
    <p class="sentence">${text.sentence(figure(error.estimate), Math.round(100 * error.confidence))}${' '}
      ${error.target ? error.met ? text.met(figure(error.target)) : html`<strong class="missed">${text.missed(figure(error.target))}</strong>` : text.noTarget}</p>
    ${error.proven !== null && html`<p class="dim">${text.proven(figure(error.proven))}</p>`}
    ${!error.bounded && html`<p class="dim">${text.unbounded}</p>`}
    ${error.limit && html`<p class="dim">${text.limits[/** @type {'target'} */ (error.limit)]}</p>`}
  </section>
  <section><h2>${text.shares}</h2>
    ${error.estimate === 0 ? html`<p class="dim">${text.none}</p>` : html`<div class="parts-bar" role="img" aria-label=${parts.map((each) => `${text.parts[each.name]} ${percent(each.share)}`).join(', ')}>
      ${parts.map((each) => html`<span class=${`part part-${each.name}`} data-share=${each.share} style=${{width: `${100 * each.share}%`}}></span>`)}</div>`}
    <table class="plain"><thead><tr><th>${text.part}</th><th class="right">${text.share}</th><th class="right">${words.queue.levels}</th></tr></thead><tbody>
      ${parts.map((each) => html`<tr><td><span class=${`key part-${each.name}`}></span>${text.parts[each.name]}</td><td class="right number">${percent(each.share)}</td><td class="right number">${figure(each.levels)}</td></tr>
        ${each.name === 'truncation' && ['depth', 'cutoff', 'tone'].filter((name) => error.parts[name] > 0).map((name) => html`<tr class="sub"><td>${text.alone[/** @type {'depth'} */ (name)]}</td><td></td><td class="right number">${figure(error.parts[name])}</td></tr>`)}`)}
      <tr class="sum"><td>${text.whole}</td><td class="right number">100 %</td><td class="right number">${figure(error.estimate)}</td></tr></tbody></table>
  </section>`;
}

/** @param {{job: Record<string, any>, heat: import('@preact/signals').Signal<Heat | null>}} properties */
export function HeatMap({job, heat}) {
  const layer = useSignal(/** @type {'error' | 'samples'} */ ('error'));
  const white = useSignal(0);
  const exr = useSignal(/** @type {import('./exr.js').Exr | null} */ (null));
  const problem = useSignal('');
  const url = job.artifacts.find((/** @type {any} */ each) => each.name === 'image.exr')?.url;
  useEffect(() => {
    if (!url || job.expired) return;
    const worker = new Caller('image-worker.js'), controller = new AbortController();
    (async () => {
      const bytes = await (await request('GET', url, {signal: controller.signal})).arrayBuffer();
      exr.value = await worker.call({method: 'exr', bytes, channels: ['error', 'samples']}, [bytes]);
    })().catch((error) => { if (!controller.signal.aborted) problem.value = error.message; });
    return () => { controller.abort(); worker.stop(); heat.value = null; };
  }, [url]);
  const values = exr.value?.channels[layer.value];
  const most = values?.reduce((largest, value) => value > largest ? value : largest, 0) || 0;
  const scale = white.value || (layer.value === 'error' ? defaultWhite(job.report?.error?.estimate || 0) : Math.max(1, most));
  useEffect(() => {
    const read = exr.value;
    if (!values || !read) return;
    let closed = false;
    const worker = new Caller('image-worker.js');
    const {width, height, channels} = read;
    worker.call({method: 'heat', values, width, height, white: scale}).then((blob) => {
      if (closed) return;
      heat.value = {url: URL.createObjectURL(blob), valueAt: (x, y) => [['error', words.queue.levels], ['samples', text.samples]]
        .filter(([name]) => channels[name]).map(([name, unit]) => `${figure(channels[name][y * width + x])} ${unit}`).join(', ')};
    });
    return () => { closed = true; worker.stop(); if (heat.value) URL.revokeObjectURL(heat.value.url); };
  }, [values, scale]);

  const again = () => attempt(async () => {
    const scene = await getJson(`/v1/jobs/${job.id}/scene`), output = scene.output || {};
    const formats = new Set([...(output.formats || ['png']), 'png', 'exr']), layers = new Set([...(output.layers || []), 'error', 'samples']);
    const made = await postJson('/v1/jobs', {...scene, output: {...output, formats: [...formats], layers: [...layers]}});
    announce(text.submitted);
    go(`#/jobs/${made.id}?tab=error`);
  });
  const hasLayers = exr.value && (exr.value.channels.error || exr.value.channels.samples);
  if (job.state !== 'succeeded' || job.kind !== 'render') return null;
  if (problem.value) return html`<section><h2>${text.map}</h2><p class="note bad">${problem.value}</p></section>`;
  if (!url || (exr.value && !hasLayers)) {
    return html`<section><h2>${text.map}</h2><p class="dim">${text.noLayer}</p>${mayWrite.value && html`<div class="buttons"><button onClick=${again}>${text.again}</button></div>`}</section>`;
  }
  return html`<section><h2>${text.map}</h2>
    <div class="buttons">${/** @type {const} */ (['error', 'samples']).map((name) => html`<button aria-pressed=${layer.value === name} disabled=${!exr.value?.channels[name]} onClick=${() => { layer.value = name; white.value = 0; }}>${text.layers[name]}</button>`)}
      <label class="switch">${text.white}<${Entry} class="white" type="number" min="0" step="any" value=${Number(scale.toPrecision(3))} onChange=${(/** @type {any} */ event) => { white.value = Math.max(0, Number(event.target.value)); }} /></label></div>
    <${HeatLegend} white=${scale} unit=${layer.value === 'error' ? words.queue.levels : text.samples} />
    <p class="dim">${text.largest(figure(most), layer.value === 'error' ? words.queue.levels : text.samples)}</p></section>`;
}
