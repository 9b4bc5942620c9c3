/** One job: its image, error, cost, document, history and webhooks. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {getJson, mayWrite, postJson} from './api.js';
import {commands} from './commands.js';
import {ErrorTab, HeatMap} from './error-tab.js';
import {Actions} from './job-actions.js';
import {documentOf, useJob} from './job-source.js';
import {count, duration, figure, size} from './format.js';
import {attempt, copy, download, Failure, imageUrl, State} from './parts.js';
import {errorText} from './queue.js';
import {route} from './routes.js';
import {Viewer} from './viewer.js';
import {words} from './words.js';

const PREVIEW_MS = 500, PREVIEW_SIDE = 1024;
const TABS = /** @type {const} */ (['image', 'error', 'cost', 'document', 'history', 'webhooks']);
const text = words.job;

/** @typedef {Record<string, any>} Job */

/** @param {Job} job */
const pngOf = (job) => job.expired ? null : job.artifacts.find((/** @type {any} */ each) => each.media_type === 'image/png') || null;

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

/** @param {{id: string}} properties */
export function JobPage({id}) {
  const {job, etag, problem} = useJob(id);
  const url = useImage(job);
  const heat = useSignal(/** @type {import('./error-tab.js').Heat | null} */ (null));
  const value = job.value;
  if (!value) return html`<div class="page">${problem.value ? html`<div class="empty"><h1>${words.titles.jobs}</h1><p>${problem.value.message}</p><a class="button" href="#/">${words.toQueue}</a></div>` : html`<p class="dim">${words.loading}</p>`}</div>`;
  const tab = /** @type {typeof TABS[number]} */ (TABS.find((each) => each === route.value.query.get('tab')) || 'image');
  const error = errorText(value);
  return html`<div class="job">
    <header class="bar">
      <h1>${value.name || words.queue.untitled}</h1> <${State} state=${value.state} />
      ${value.state === 'running' && html`<span class="number">${Math.floor(value.progress * 100)} % ${value.eta_s ? html`<span class="dim">${text.left(duration(value.eta_s))}</span>` : ''}</span>`}
      ${error && html`<span class="number">${error} ${text.confidence(Math.round(100 * value.report.error.confidence))}</span>`}
      ${value.report && html`<span class="number dim">${duration(value.report.time_ms.trace / 1000)}</span>`}
      <span class="spring"></span>
      <${Actions} job=${job} etag=${etag} />
    </header>
    ${value.state === 'running' && html`<progress max="1" value=${value.progress} aria-label=${words.queue.columns.progress}></progress>`}
    <${Viewer} url=${url.value} alt=${text.imageAlt(value.name || words.queue.untitled)} size=${value.image} cover=${tab === 'error' && heat.value ? heat.value.url : ''} coverAlt=${text.heat}
      valueAt=${heat.value && tab === 'error' ? heat.value.valueAt : undefined}>
      <h2>${text.noImage[/** @type {'queued'} */ (value.state)]}</h2>
      <p>${value.problem ? value.problem.detail : value.queue_position ? text.position(value.queue_position) : ''}</p>
    </${Viewer}>
    <div class="tabs">
      <nav aria-label=${words.titles.jobs}>${TABS.map((each) => html`<a href=${`#/jobs/${id}?tab=${each}`} aria-current=${each === tab ? 'page' : undefined}>${text.tabs[each]}</a>`)}</nav>
      <div class="tab">
        ${value.problem && html`<${Trouble} job=${value} />`}
        ${tab === 'image' && html`<${Files} job=${value} />`}
        ${tab === 'error' && html`<${ErrorTab} job=${value} /><${HeatMap} job=${value} heat=${heat} />`}
        ${tab === 'cost' && html`<${Cost} job=${value} />`}
        ${tab === 'document' && html`<${Document} job=${value} />`}
        ${tab === 'history' && html`<${History} job=${value} />`}
        ${tab === 'webhooks' && html`<${Webhooks} job=${value} />`}
      </div>
    </div>
  </div>`;
}

/** Why the job failed, with links into its document. @param {{job: Job}} properties */
function Trouble({job}) {
  return html`<div class="note bad"><strong>${job.problem.code}</strong>: ${job.problem.detail}
    ${(job.problem.errors || []).map((/** @type {any} */ each) => html`<br /><a href=${`#/edit/${job.id}?at=${encodeURIComponent(each.pointer)}`}><code>${each.pointer}</code></a> ${each.detail}`)}</div>`;
}

/** @param {{job: Job}} properties */
function Files({job}) {
  const save = (/** @type {any} */ artifact) => attempt(() => download(artifact.url, `${job.name || job.id}.${artifact.name.replace('image.', '')}`));
  return html`<dl class="facts-list">
      <dt>${text.id}</dt><dd><code>${job.id}</code></dd>
      ${job.image && html`<dt>${words.queue.columns.size}</dt><dd class="number">${job.image.width} × ${job.image.height}</dd>`}
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
    <section><h2>${text.samples}</h2><p class="number">${text.samplesOf(figure(report.samples.min), figure(report.samples.mean), figure(report.samples.max))}</p>
      <p class="number dim">${size(report.memory_bytes)} ${report.geometry_reused ? text.reused : ''}</p></section>
    <section><h2>${words.playground.needs}</h2><ul class="needs">${Object.entries(report.reasons || {}).map(([name, pointer]) => html`<li>${name.replaceAll('_', ' ')} <a href=${`#/edit/${job.id}?at=${encodeURIComponent(String(pointer))}`}><code>${String(pointer)}</code></a></li>`)}</ul></section>`;
}

/** @param {{job: Job}} properties */
function Document({job}) {
  const document = useSignal(''), problem = useSignal(/** @type {any} */ (null));
  const host = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    let left = false, close = () => {};
    Promise.all([documentOf(job.id), import('./editor.js')]).then(([value, {Editor}]) => {
      if (left || !host.current) return;
      const editor = new Editor(host.current, {text: value, readOnly: true});
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
