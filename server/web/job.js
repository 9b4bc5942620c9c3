/** One job: its image, error, cost, document, history and webhooks. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {getJson, mayWrite, postJson} from './api.js';
import {ErrorTab, HeatMap} from './error-tab.js';
import {Actions} from './job-actions.js';
import {documentOf, useJob} from './job-source.js';
import {count, duration, figure, size} from './format.js';
import {announce, attempt, copy, download, Entry, Failure, imageUrl, missedTarget, NotModelled, Splitter, State} from './parts.js';
import {errorText} from './queue.js';
import {addKeys, DIGITS} from './keys.js';
import {LiveStage} from './live/session.js';
import {readable} from './pointers.js';
import {route, setQuery} from './routes.js';
import {commands} from './scenes.js';
import {Viewer} from './viewer.js';
import {words} from './words.js';

const PREVIEW_MS = 500, PREVIEW_SIDE = 1024, LAYER_SIDE = 2048, STOPS_MAX = 100;
/** Layers that the service draws, and those that are light, which has an exposure. */
const LAYERS = ['color', 'depth', 'normal', 'albedo', 'object_id', 'samples', 'error'], LIGHT = ['color', 'albedo'], COUNTS = ['samples', 'error'];
const TABS = /** @type {const} */ (['image', 'error', 'cost', 'document', 'history', 'webhooks']);
const text = words.job;

/** @typedef {Record<string, any>} Job */

/** @param {Job} job */
const pngOf = (job) => job.expired || job.kind === 'measure' ? null : job.artifacts.find((/** @type {any} */ each) => each.media_type === 'image/png') || null;

/** The image of the job, or the samples so far. @param {import('@preact/signals').Signal<Job | null>} job */
function useImage(job) {
  const url = useSignal('');
  const id = job.value?.id, png = job.value && pngOf(job.value)?.url;
  const isTraced = job.value?.state === 'running' && job.value.kind === 'render';
  useEffect(() => {
    const controller = new AbortController();
    let timer = 0;
    const show = (/** @type {string} */ made) => {
      if (!made) return;
      URL.revokeObjectURL(url.value);
      url.value = made;
    };
    const preview = async () => {
      await imageUrl(`/v1/jobs/${id}/preview?max=${PREVIEW_SIDE}`, controller.signal).then(show, () => undefined);
      if (!controller.signal.aborted) timer = window.setTimeout(preview, PREVIEW_MS);
    };
    if (png) imageUrl(png, controller.signal).then(show, () => undefined);
    else if (isTraced) preview();
    return () => { controller.abort(); clearTimeout(timer); };
  }, [id, png, isTraced]);
  useEffect(() => () => URL.revokeObjectURL(url.value), []);
  return url;
}

/** The layer and the exposure that the address names, as an image of the service; empty: the image itself. @param {Job | null} job */
function useLayer(job) {
  const url = useSignal(''), query = route.value.query;
  const layer = LAYERS.find((each) => each === query.get('layer')) || 'color', stops = LIGHT.includes(layer) ? Number(query.get('exposure')) || 0 : 0;
  const wanted = job?.state === 'succeeded' && job.kind === 'render' && !job.expired && (layer !== 'color' || stops !== 0);
  useEffect(() => {
    if (!wanted || !job) return;
    const controller = new AbortController();
    const parameters = `layer=${layer}&max=${LAYER_SIDE}${stops !== 0 ? `&exposure=${stops}` : ''}${COUNTS.includes(layer) ? '&map=heat' : ''}`;
    imageUrl(`/v1/jobs/${job.id}/view.png?${parameters}`, controller.signal).then((made) => { url.value = made; }, (error) => { if (!controller.signal.aborted) announce(error.message); });
    return () => { controller.abort(); URL.revokeObjectURL(url.value); url.value = ''; };
  }, [job?.id, wanted, layer, stops]);
  return {layer, stops, url: url.value};
}

/** @param {{id: string}} properties */
export function JobPage({id}) {
  const {job, etag, problem} = useJob(id);
  const url = useImage(job);
  const view = useLayer(job.value);
  const heat = useSignal(/** @type {import('./error-tab.js').Heat | null} */ (null));
  const value = job.value;
  if (!value) return html`<div class="page">${problem.value ? html`<div class="empty"><h1>${words.titles.jobs}</h1><p>${problem.value.message}</p><a class="button" href="#/">${words.toQueue}</a></div>` : html`<p class="dim">${words.loading}</p>`}</div>`;
  const tab = /** @type {typeof TABS[number]} */ (TABS.find((each) => each === route.value.query.get('tab')) || 'image');
  const error = errorText(value);
  const tabRoute = (/** @type {string} */ name) => {
    const query = new URLSearchParams(route.value.query);
    query.set('tab', name);
    return `#/jobs/${id}?${query}`;
  };
  return html`<div class="job">
    <header class="bar">
      <div class="title"><h1>${value.name || words.queue.untitled}</h1> <${State} state=${value.state} job=${value} />
      ${value.state === 'running' && html`<span class="number">${Math.floor(value.progress * 100)} % ${value.eta_s ? html`<span class="dim">${text.left(duration(value.eta_s))}</span>` : ''}</span>`}
      ${error && html`<span class=${`number ${missedTarget(value) ? 'missed' : ''}`}>${error} ${text.confidence(Math.round(100 * value.report.error.confidence))}</span>`}
      ${value.report && html`<span class="number dim">${duration(value.report.time_ms.trace / 1000)}</span>`}</div>
      <div class="actions"><${Actions} job=${job} etag=${etag} /></div>
    </header>
    ${value.state === 'running' && html`<progress max="1" value=${value.progress} aria-label=${words.queue.columns.progress}></progress>`}
    ${value.kind === 'render' && mayWrite.value && route.value.query.get('live') ? html`<${LiveStage} key=${id} id=${id} url=${url.value} alt=${text.imageAlt(value.name || words.queue.untitled)} />` : html`<${Viewer} url=${tab === 'image' && view.url || url.value} alt=${text.imageAlt(value.name || words.queue.untitled)} size=${value.image} cover=${tab === 'error' && heat.value ? heat.value.url : ''} coverAlt=${text.heat}
      valueAt=${heat.value && tab === 'error' ? heat.value.valueAt : undefined}>
      ${value.kind === 'measure' ? html`<h2>${text.isMeasurement}</h2><p>${text.isMeasurementText}</p><a class="button primary" href=${`#/measure/${id}`}>${text.tradeOff}</a>`
        : html`<h2>${text.noImage[/** @type {'queued'} */ (value.state)]}</h2><p>${value.problem ? value.problem.detail : waits(value)}</p>`}
    </${Viewer}>`}
    <${Splitter} name="tabs" label=${words.panes.tabs} />
    <div class="tabs">
      <nav aria-label=${words.titles.jobs}>${TABS.map((each) => html`<a href=${tabRoute(each)} aria-current=${each === tab ? 'page' : undefined}>${text.tabs[each]}</a>`)}</nav>
      <div class="tab">
        ${value.problem && html`<${Trouble} job=${value} />`}
        ${tab === 'image' && html`<${Layers} job=${value} view=${view} /><${Files} job=${value} />`}
        ${tab === 'error' && html`<${ErrorTab} job=${value} /><${HeatMap} job=${value} heat=${heat} />`}
        ${tab === 'cost' && html`<${Cost} job=${value} />`}
        ${tab === 'document' && html`<${Document} job=${value} />`}
        ${tab === 'history' && html`<${History} job=${value} />`}
        ${tab === 'webhooks' && html`<${Webhooks} job=${value} />`}
      </div>
    </div>
  </div>`;
}

/** @param {Job} job */
function waits({state, not_before: at, queue_position: place}) {
  if (state !== 'queued') return '';
  return at && Date.parse(at) > Date.now() ? text.startsAt(new Date(at).toLocaleString()) : place ? text.position(place) : '';
}

/** Why the job failed, with links into its document. @param {{job: Job}} properties */
function Trouble({job}) {
  return html`<div class="note bad"><strong>${job.problem.code}</strong>: ${job.problem.detail}
    ${(job.problem.errors || []).map((/** @type {any} */ each) => html`<br /><a href=${`#/edit/${job.id}?at=${encodeURIComponent(each.pointer)}`}><code>${each.pointer}</code></a> ${each.detail}`)}</div>`;
}

/** Chooses what is shown: the image at an exposure, or a layer of its OpenEXR file. @param {{job: Job, view: {layer: string, stops: number}}} properties */
function Layers({job, view}) {
  const layers = useSignal(['color']), {layer, stops} = view;
  const hasLayers = job.report?.requirements.layers && job.artifacts.some((/** @type {any} */ each) => each.name === 'image.exr');
  const isShown = job.state === 'succeeded' && job.kind === 'render' && !job.expired;
  useEffect(() => {
    if (!hasLayers) return;
    documentOf(job.id).then((document) => { const requested = JSON.parse(document).output?.layers || []; layers.value = LAYERS.filter((each) => each === 'color' || requested.includes(each)); }, () => undefined);
  }, [job.id, hasLayers]);
  const show = (/** @type {string} */ name) => setQuery({layer: name === 'color' ? null : name});
  const brighten = (/** @type {number} */ by) => expose((Number(route.value.query.get('exposure')) || 0) + by);
  const expose = (/** @type {number} */ to) => setQuery({exposure: to === 0 ? null : String(Math.max(-STOPS_MAX, Math.min(STOPS_MAX, to)))});
  useEffect(() => isShown ? addKeys({[DIGITS]: (key) => { const name = layers.value[Number(key) - 1]; if (name) show(name); }, '[': () => brighten(-1), ']': () => brighten(1)}) : undefined, [isShown]);
  if (!isShown) return null;
  return html`<section><h2>${text.view}</h2>
    ${layers.value.length > 1 && html`<div class="buttons" role="group" aria-label=${text.layer}>${layers.value.map((name) => html`<button aria-pressed=${layer === name} onClick=${() => show(name)}>${text.layers[/** @type {'color'} */ (name)]}</button>`)}</div>`}
    ${LIGHT.includes(layer) && html`<label class="switch">${text.exposure}<${Entry} class="stops" type="number" step="0.5" min=${-STOPS_MAX} max=${STOPS_MAX} value=${stops} onChange=${(/** @type {any} */ event) => expose(Number(event.target.value) || 0)} />${text.stops}</label>`}
  </section>`;
}

/** @param {{job: Job}} properties */
function Files({job}) {
  const save = (/** @type {any} */ artifact) => attempt(() => download(artifact.url, `${job.name || job.id}.${artifact.name.replace('image.', '')}`));
  return html`<dl class="facts-list">
      <dt>${text.id}</dt><dd><code>${job.id}</code></dd>
      ${job.image && html`<dt>${words.queue.columns.size}</dt><dd class="number">${job.image.width} × ${job.image.height}</dd>`}
      <dt>${text.submitted}</dt><dd class="number"><time datetime=${job.created_at}>${new Date(job.created_at).toLocaleString()}</time></dd>
      <dt>${words.queue.columns.priority}</dt><dd class="number">${job.priority}</dd>
      ${job.owner && html`<dt>${text.owner}</dt><dd>${job.owner}</dd>`}
      ${job.batch && html`<dt>${text.batch}</dt><dd><a href=${`#/batches/${job.batch}`}><code>${job.batch}</code></a></dd>`}
      ${Object.entries(job.labels || {}).map(([name, value]) => html`<dt>${name}</dt><dd>${value}</dd>`)}
    </dl>
    ${job.artifacts.length === 0 ? html`<p class="dim">${job.expired ? text.expired : text.noFiles}</p>` : html`<table class="plain"><thead><tr><th>${text.file}</th><th class="right">${words.queue.columns.size}</th><th>SHA-256</th></tr></thead><tbody>
      ${job.artifacts.map((/** @type {any} */ each) => html`<tr><td><button class="link" onClick=${() => save(each)}>${each.name}</button></td><td class="right number">${size(each.bytes)}</td><td><code title=${each.sha256}>${each.sha256.slice(0, 12)}…</code></td></tr>`)}</tbody></table>`}`;
}

/** @param {{job: Job}} properties */
function Cost({job}) {
  const report = job.report;
  if (!report) return html`<p class="dim">${text.notYet}</p>`;
  const stages = Object.entries(report.time_ms), total = stages.reduce((sum, [, ms]) => sum + Number(ms), 0) || 1;
  return html`<section><h2>${text.time}</h2><div class="parts-bar" role="img" aria-label=${text.time}>${stages.map(([name, ms]) => html`<span class=${`part part-${name}`} style=${{width: `${100 * Number(ms) / total}%`}}></span>`)}</div>
      <table class="plain"><tbody>${stages.map(([name, ms]) => html`<tr><td><span class=${`key part-${name}`}></span>${name}</td><td class="right number">${duration(Number(ms) / 1000)}</td><td class="right number dim">${Math.round(100 * Number(ms) / total)} %</td></tr>`)}</tbody></table></section>
    <section><h2>${text.rays}</h2><table class="plain"><tbody>${Object.entries(report.rays).map(([name, rays]) => html`<tr><td>${name}</td><td class="right number">${count(Number(rays))}</td></tr>`)}
      ${report.culled_shadows?.rays > 0 && html`<tr><td>${text.culled}</td><td class="right number">${count(report.culled_shadows.rays)}</td></tr>`}</tbody></table></section>
    ${report.radiosity && html`<section><h2>${text.radiosity}</h2><table class="plain"><tbody>${Object.entries(report.radiosity).map(([name, value]) => html`<tr><td>${name}</td><td class="right number">${typeof value === 'boolean' ? text.yesNo(value) : value === null ? text.noBound : name === 'bound' ? figure(value) : count(Number(value))}</td></tr>`)}</tbody></table></section>`}
    <section><h2>${text.samples}</h2><p class="number">${text.samplesOf(figure(report.samples.min), figure(report.samples.mean), figure(report.samples.max))}</p>
      <p class="dim">${words.system.memory} <span class="number">${size(report.memory_bytes)}</span> ${report.geometry_reused ? text.reused : ''}</p></section>
    <section><h2>${words.playground.needs}</h2><ul class="needs">${Object.entries(report.reasons || {}).map(([name, pointer]) => html`<li>${name.replaceAll('_', ' ')} <a href=${`#/edit/${job.id}?at=${encodeURIComponent(String(pointer))}`}><code>${String(pointer)}</code></a></li>`)}</ul>
      <${NotModelled} requirements=${report.requirements} /></section>`;
}

/** @param {{job: Job}} properties */
function Document({job}) {
  const document = useSignal(''), problem = useSignal(/** @type {any} */ (null));
  const host = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    let left = false, close = () => {};
    Promise.all([documentOf(job.id), import('./editor.js')]).then(([value, {Editor}]) => {
      if (left || !host.current) return;
      const editor = new Editor(host.current, {text: readable(value), readOnly: true});
      close = () => editor.destroy();
      document.value = value;
    }, (error) => { problem.value = error; });
    return () => { left = true; close(); };
  }, [job.id]);
  return html`<${Failure} problem=${problem.value} />
    <div class="buttons"><a class="button" href=${`#/edit/${job.id}`}>${text.edit}</a><button onClick=${() => copy(document.value)}>${text.copyDocument}</button>
      ${document.value && Object.entries(commands).map(([name, command]) => html`<button onClick=${() => copy(command(document.value))}>${text.copyAs(words.playground.commands[/** @type {'curl'} */ (name)])}</button>`)}</div>
    <div class="document"><div class="editor" ref=${host}></div></div>`;
}

/** The moves of the job between states. @param {{job: Job}} properties */
function History({job}) {
  const moves = useSignal(/** @type {any[] | null} */ (null)), problem = useSignal(/** @type {any} */ (null));
  useEffect(() => { getJson(`/v1/jobs/${job.id}/history`).then((reply) => { moves.value = reply.items; problem.value = null; }, (error) => { problem.value = error; }); }, [job.id, job.state, job.attempt]);
  const time = (/** @type {string} */ at) => new Date(at).toLocaleString();
  return html`<${Failure} problem=${problem.value} />
    ${moves.value && html`<table class="plain moves"><thead><tr><th scope="col">${text.at}</th><th scope="col">${words.queue.columns.state}</th><th scope="col" class="right">${text.attempt}</th></tr></thead><tbody>
      ${moves.value.map((each) => html`<tr><td class="number"><time datetime=${each.at} title=${each.at}>${time(each.at)}</time></td><td><${State} state=${each.state} />
        ${(each.code || each.detail) && html`<div class="dim">${each.code && html`<code>${each.code}</code>`} ${each.detail}</div>`}
        ${each.worker && html`<div class="dim">${text.worker} <code>${each.worker.slice(0, 12)}</code></div>`}</td><td class="right number">${each.attempt} / ${job.max_attempts}</td></tr>`)}</tbody></table>`}
    ${job.expires_at && html`<p class="dim">${text.expires(time(job.expires_at))}</p>`}`;
}

/** @param {{job: Job}} properties */
function Webhooks({job}) {
  const items = useSignal(/** @type {any[] | null} */ (null));
  useEffect(() => { getJson(`/v1/jobs/${job.id}/deliveries`).then((reply) => { items.value = reply.items; }, () => { items.value = []; }); }, [job.id, job.state]);
  if (!items.value) return null;
  if (items.value.length === 0) return html`<p class="dim">${text.noWebhooks}</p>`;
  const again = (/** @type {string} */ delivery) => postJson(`/v1/jobs/${job.id}/deliveries/${delivery}/redeliver`, undefined).then((reply) => { items.value = reply.items; });
  return html`<table class="plain"><tbody>${items.value.map((each) => html`<tr><td>${each.event}</td><td>${each.state}</td><td>${each.url}</td><td>${mayWrite.value && html`<button onClick=${() => again(each.id)}>${text.again}</button>`}</td></tr>`)}</tbody></table>`;
}
