/** Batches: the list, and one batch as a contact sheet along the axes of its sweep. */
import {signal, useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useMemo} from 'preact/hooks';
import {getJson, mayWrite, postJson, request} from './api.js';
import {NewBatch} from './batch-form.js';
import {age, count, duration} from './format.js';
import {JobList} from './job-list.js';
import {attempt, Bell, Dialog, download, Failure, State, Thumbnail} from './parts.js';
import {go} from './routes.js';
import {listen} from './store.js';
import {indexOf} from './sweep.js';
import {words} from './words.js';

const READ_MS = 1000, THUMBNAIL_SIDE = 256, CELLS = 400;
const text = words.batches;

/** @typedef {Record<string, any>} Batch */
/** @typedef {Record<string, any>} Job */

/** Calls `read` now and after events of batches, at most once a second. @param {() => void} read @param {string} [batch] */
function useEvents(read, batch) {
  useEffect(() => {
    let timer = 0;
    const soon = () => { timer ||= window.setTimeout(() => { timer = 0; read(); }, READ_MS); };
    const stop = listen({event: (event) => { if (event.type !== 'progress' && (batch ? event.batch === batch : event.batch)) soon(); }, reload: soon});
    read();
    return () => { stop(); clearTimeout(timer); };
  }, [batch]);
}

/** @param {{id: string}} properties */
export function Batches({id}) {
  if (id === 'new' && mayWrite.value) return html`<${NewBatch} />`;
  return id && id !== 'new' ? html`<${One} id=${id} />` : html`<${List} />`;
}

function List() {
  const items = useSignal(/** @type {Batch[] | null} */ (null)), cursor = useSignal(/** @type {string | null} */ (null)), problem = useSignal(/** @type {any} */ (null));
  const read = (/** @type {string | null} */ from) => getJson(`/v1/batches${from ? `?cursor=${encodeURIComponent(from)}` : ''}`).then((page) => {
    const first = new Set(page.items.map((/** @type {Batch} */ each) => each.id)), older = (items.value || []).filter((each) => !first.has(each.id));
    if (from) items.value = [...older, ...page.items];
    else {
      items.value = page.next_cursor && page.items.length > 0 ? [...page.items, ...older.filter((each) => each.id < page.items.at(-1).id)] : page.items;
      if (items.value?.length === page.items.length) cursor.value = page.next_cursor;
    }
    if (from) cursor.value = page.next_cursor;
    problem.value = null;
  }, (error) => { problem.value = error; });
  useEvents(() => read(null));
  const create = mayWrite.value && html`<a class="button primary" href="#/batches/new">${text.create}</a>`;
  return html`<div class="page">
    <header class="heading"><h1>${words.titles.batches}</h1><span class="spring"></span>${items.value?.length ? create : ''}</header>
    <${Failure} problem=${problem.value} />
    ${items.value?.length === 0 ? html`<div class="empty"><h2>${text.empty}</h2><p>${text.emptyText}</p>${create}</div>`
      : items.value && html`<section class="panel batch-list"><table class="plain"><thead><tr><th scope="col">${words.queue.columns.name}</th><th scope="col">${words.queue.columns.state}</th>
          <th scope="col" class="wide">${words.queue.columns.progress}</th><th scope="col" class="right">${text.jobs}</th><th scope="col" class="right">${words.queue.columns.age}</th></tr></thead><tbody>
        ${items.value.map((each) => html`<tr key=${each.id} data-id=${each.id}><td><a href=${`#/batches/${each.id}`}>${each.name || words.queue.untitled}</a></td><td><${State} state=${each.state} /></td>
          <td class="wide">${each.progress < 1 && html`<progress max="1" value=${each.progress} aria-label=${words.queue.columns.progress}></progress>`}</td><td class="right number">${count(each.size)}</td>
          <td class="right number">${age(each.created_at, Date.now())}</td></tr>`)}</tbody></table>
        ${cursor.value && html`<button onClick=${() => read(cursor.value)}>${text.more}</button>`}</section>`}
  </div>`;
}

/** @param {{id: string}} properties */
function One({id}) {
  const batch = useSignal(/** @type {Batch | null} */ (null)), problem = useSignal(/** @type {any} */ (null));
  useEvents(() => getJson(`/v1/batches/${id}`).then((body) => { batch.value = body; problem.value = null; }, (error) => { problem.value = error; }), id);
  const list = useMemo(() => new JobList({batch: id}), [id]);
  useEffect(() => () => list.close(), [list]);
  list.version.value;
  useEffect(() => { list.more(); });  // until all jobs are known
  const value = batch.value;
  if (!value) return html`<div class="page">${problem.value ? html`<div class="empty"><h1>${words.titles.batches}</h1><p>${problem.value.message}</p><a class="button" href="#/batches">${text.toList}</a></div>` : html`<p class="dim">${words.loading}</p>`}</div>`;
  const isOpen = value.state === 'queued' || value.state === 'running';
  const shares = Object.entries(value.jobs).filter(([, n]) => n > 0);
  return html`<div class="page batch">
    <header class="heading"><h1>${value.name || words.queue.untitled}</h1> <${State} state=${value.state} />${isOpen && html`<span class="number">${Math.floor(value.progress * 100)} %</span>`}
      <span class="spring"></span><${Actions} batch=${batch} list=${list} /></header>
    ${isOpen && html`<progress max="1" value=${value.progress} aria-label=${words.queue.columns.progress}></progress>`}
    <p class="dim shares">${text.created(count(value.size), age(value.created_at, Date.now()))} ${shares.map(([name, n]) => html`<a href=${`#/?batch=${id}&state=${name}`}><${State} state=${name} /> <span class="number">${count(Number(n))}</span></a>`)}</p>
    <${Failure} problem=${problem.value || list.problem.value} />
    <${Sheet} batch=${value} list=${list} />
  </div>`;
}

/** @param {{batch: import('@preact/signals').Signal<Batch | null>, list: JobList}} properties */
function Actions({batch, list}) {
  const asked = useSignal(/** @type {'' | 'cancel' | 'remove'} */ (''));
  const {id, name, links, jobs} = /** @type {Batch} */ (batch.value);
  const open = (jobs.queued || 0) + (jobs.running || 0);
  const post = (/** @type {string} */ path) => attempt(async () => {
    asked.value = '';
    batch.value = await postJson(path, undefined);
    list.scheduleReload();
  });
  const remove = () => attempt(async () => { asked.value = ''; await request('DELETE', `/v1/batches/${id}`); go('#/batches'); });
  const tar = () => attempt(() => download(links.artifacts, `${name || id}.tar`));
  const total = Object.values(jobs).reduce((sum, each) => sum + Number(each), 0);
  return html`${open > 0 && html`<${Bell} ids=${[`batch/${id}`]} label=${words.bell.ringBatch} />`}
    ${links.artifacts && html`<button onClick=${tar}>${text.tar}</button>`}
    ${mayWrite.value && html`${links.retry && html`<button onClick=${() => post(links.retry)}>${text.retry}</button>`}
      ${links.cancel && html`<button onClick=${() => { asked.value = 'cancel'; }}>${words.queue.cancel}</button>`}
      ${open === 0 && html`<button class="danger" onClick=${() => { asked.value = 'remove'; }}>${words.queue.remove}</button>`}
      <${Dialog} open=${asked.value !== ''} onClose=${() => { asked.value = ''; }} title=${words.job.sure}>${asked.value && html`<div class="stack"><h2>${words.queue.confirm[asked.value](asked.value === 'cancel' ? open : total)}</h2>
        <div class="row"><button onClick=${() => { asked.value = ''; }}>${words.queue.back}</button>
          <button class="primary" onClick=${asked.value === 'cancel' ? () => post(links.cancel) : remove}>${words.queue.doIt[asked.value]}</button></div></div>`}</${Dialog}>`}`;
}

/** How many cells are shown; more on request. */
const shownCells = signal(CELLS);

/** The jobs by their place in the batch. @param {{batch: Batch, list: JobList}} properties */
function Sheet({batch, list}) {
  const places = useSignal(/** @type {number[]} */ ([]));
  list.version.value;
  /** @type {Map<number, Job>} */
  const jobs = new Map();
  for (const id of list.order) {
    const job = list.jobs.get(id);
    if (job?.variation) jobs.set(job.variation.index, job);
  }
  useEffect(() => { list.refresh(list.order); });
  const axes = Object.keys(batch.sweep || {});
  if (axes.length < 2) {
    const cells = Math.min(batch.size, shownCells.value), axis = axes[0];
    return html`<ul class="sheet">${Array.from({length: cells}, (_, index) => html`<li key=${index}><${Cell} job=${jobs.get(index)} index=${index} label=${axis ? valueText(batch.sweep[axis][index]) : frameText(jobs.get(index), index)} /></li>`)}</ul>
      ${axis && html`<p class="dim"><code>${axis}</code></p>`}
      ${cells < batch.size && html`<button onClick=${() => { shownCells.value += CELLS; }}>${text.moreJobs(count(batch.size - cells))}</button>`}`;
  }
  const [rows, columns] = axes.slice(-2), others = axes.slice(0, -2);
  const at = (/** @type {number} */ row, /** @type {number} */ column) => indexOf(batch.sweep, [...others.map((_, axis) => places.value[axis] || 0), row, column]);
  return html`${others.length > 0 && html`<div class="wishes">${others.map((axis, place) => html`<label><code>${axis}</code> <select value=${places.value[place] || 0}
      onChange=${(/** @type {any} */ event) => { const next = [...places.value]; next[place] = Number(event.target.value); places.value = next; }}>
      ${batch.sweep[axis].map((/** @type {any} */ each, /** @type {number} */ i) => html`<option value=${i}>${valueText(each)}</option>`)}</select></label>`)}</div>`}
    <div class="panel axes" tabindex="0" role="region" aria-label=${text.sheet}><table>
      <thead><tr><td><code>${rows}</code> ↓ <code>${columns}</code> →</td>${batch.sweep[columns].map((/** @type {any} */ each) => html`<th scope="col" class="number">${valueText(each)}</th>`)}</tr></thead>
      <tbody>${batch.sweep[rows].map((/** @type {any} */ each, /** @type {number} */ row) => html`<tr><th scope="row" class="number">${valueText(each)}</th>
        ${batch.sweep[columns].map((/** @type {any} */ _, /** @type {number} */ column) => html`<td><${Cell} job=${jobs.get(at(row, column))} index=${at(row, column)} label="" /></td>`)}</tr>`)}</tbody></table></div>`;
}

/** @param {any} value */
const valueText = (value) => JSON.stringify(value).slice(0, 40);

/** What a frame changes. @param {Job | undefined} job @param {number} index */
const frameText = (job, index) => job?.variation?.values?.name ? job.name : job?.variation?.values ? JSON.stringify(job.variation.values).slice(1, -1).slice(0, 60) : text.frame(index);

/** One job of the sheet, or its empty place. @param {{job: Job | undefined, index: number, label: string}} properties */
function Cell({job, index, label}) {
  if (!job) return html`<span class="cell" data-index=${index}><span class="thumb"></span><span class="dim">${label || text.gone}</span></span>`;
  const failed = job.state === 'failed', retry = () => attempt(async () => { await postJson(`/v1/jobs/${job.id}/retry`, undefined); });
  const name = `${text.frame(index)}, ${words.states[/** @type {'failed'} */ (job.state)]}`;
  return html`<span class="cell" data-index=${index} data-id=${job.id} data-state=${job.state}><a href=${`#/jobs/${job.id}`} aria-label=${label ? `${label}, ${name}` : name}><${Thumbnail} job=${job} side=${THUMBNAIL_SIDE} /></a>
    ${label && html`<span class="number">${label}</span>`}
    ${job.state === 'running' ? html`<progress max="1" value=${job.progress} aria-label=${words.queue.columns.progress}></progress>`
      : job.state === 'succeeded' ? html`<span class="dim number">${job.report ? duration(job.report.time_ms.trace / 1000) : ''}</span>` : html`<${State} state=${job.state} />`}
    ${failed && html`<span class="reason">${job.problem?.detail}</span>${mayWrite.value && html`<button onClick=${retry}>${words.queue.retry}</button>`}`}</span>`;
}
