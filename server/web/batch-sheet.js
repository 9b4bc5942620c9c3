/** The contact sheet of a batch: its jobs along the axes of the sweep. Only the cells in view exist. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {mayWrite, postJson} from './api.js';
import {duration} from './format.js';
import {attempt, Icon, State, Thumbnail} from './parts.js';
import {indexOf, leaves} from './sweep.js';
import {useWindow} from './windowed.js';
import {words} from './words.js';

/** Px, as in app.css. */
const CELL = {width: 168, height: 178, gap: 10};
const THUMBNAIL_SIDE = 256, SMALL_SIDE = 128, MANY = 100;
const text = words.batches;

/** @typedef {Record<string, any>} Batch */
/** @typedef {Record<string, any>} Job */
/** @typedef {import('./job-list.js').JobList} JobList */

/** The jobs by their place in the batch. @param {JobList} list */
export function jobsByIndex(list) {
  /** @type {Map<number, Job>} */
  const jobs = new Map();
  for (const id of list.order) {
    const job = list.jobs.get(id);
    if (job?.variation) jobs.set(job.variation.index, job);
  }
  return jobs;
}

/** @param {{batch: Batch, list: JobList, jobs: Map<number, Job>}} properties */
export function Sheet({batch, list, jobs}) {
  const axes = Object.keys(batch.sweep || {});
  const refresh = (/** @type {number[]} */ indices) => { list.refresh(indices.flatMap((index) => jobs.get(index)?.id ?? [])); };
  return axes.length < 2 ? html`<${Sequence} batch=${batch} jobs=${jobs} refresh=${refresh} axis=${axes[0]} />` : html`<${Axes} batch=${batch} jobs=${jobs} refresh=${refresh} />`;
}

/** @param {{batch: Batch, jobs: Map<number, Job>, refresh: (indices: number[]) => void, axis: string | undefined}} properties */
function Sequence({batch, jobs, refresh, axis}) {
  const box = useRef(/** @type {HTMLElement | null} */ (null)), columns = useSignal(1);
  useEffect(() => {
    const observer = new ResizeObserver(([{contentRect}]) => { columns.value = Math.max(1, Math.floor((contentRect.width + CELL.gap) / (CELL.width + CELL.gap))); });
    if (box.current) observer.observe(box.current);
    return () => observer.disconnect();
  }, []);
  const rows = Math.ceil(batch.size / columns.value), pitch = CELL.height + CELL.gap;
  const {first, last} = useWindow(box, rows, pitch), begin = first * columns.value;
  const shown = Array.from({length: Math.max(0, Math.min(batch.size, last * columns.value) - begin)}, (_, i) => begin + i);
  useEffect(() => refresh(shown));
  const label = (/** @type {number} */ index) => axis ? valueText(batch.sweep[axis][index]) : frameText(jobs.get(index), index);
  return html`${axis && html`<p class="dim"><code>${axis}</code></p>`}
    <div ref=${box} style=${{height: `${rows * pitch - CELL.gap}px`}}>
      <ul class="sheet" aria-label=${text.sheet} style=${{transform: `translateY(${first * pitch}px)`, gridTemplateColumns: `repeat(${columns.value}, minmax(0, 1fr))`}}>${shown.map((index) =>
        html`<li key=${index} aria-posinset=${index + 1} aria-setsize=${batch.size}><${Cell} job=${jobs.get(index)} index=${index} label=${label(index)} many=${batch.size > MANY} /></li>`)}</ul></div>`;
}

/** Two axes as rows and columns, the others as pickers. @param {{batch: Batch, jobs: Map<number, Job>, refresh: (indices: number[]) => void}} properties */
function Axes({batch, jobs, refresh}) {
  const places = useSignal(/** @type {number[]} */ ([])), body = useRef(/** @type {HTMLElement | null} */ (null));
  const axes = Object.keys(batch.sweep), [down, across] = axes.slice(-2), others = axes.slice(0, -2);
  const rows = batch.sweep[down], columns = batch.sweep[across];
  const at = (/** @type {number} */ row, /** @type {number} */ column) => indexOf(batch.sweep, [...others.map((_, axis) => places.value[axis] || 0), row, column]);
  const inRows = useWindow(body, rows.length, CELL.height + CELL.gap), inColumns = useWindow(body, columns.length, CELL.width + CELL.gap, true);
  const span = (/** @type {{first: number, last: number}} */ {first, last}) => Array.from({length: last - first}, (_, i) => first + i);
  const [shownRows, shownColumns] = [span(inRows), span(inColumns)];
  useEffect(() => refresh(shownRows.flatMap((row) => shownColumns.map((column) => at(row, column)))));
  /** The place of lines that are out of view. @param {number} lines @param {'width' | 'height'} way */
  const space = (lines, way) => lines > 0 && html`<td aria-hidden="true" style=${{[way]: `${lines * (CELL[way] + CELL.gap) - CELL.gap}px`, [`min-${way}`]: `${lines * (CELL[way] + CELL.gap) - CELL.gap}px`}}></td>`;
  const spaceRow = (/** @type {number} */ lines) => lines > 0 && html`<tr>${space(lines, 'height')}</tr>`;
  return html`${others.length > 0 && html`<div class="form-fields">${others.map((axis, place) => html`<label><code>${axis}</code> <select value=${places.value[place] || 0}
      onChange=${(/** @type {any} */ event) => { const next = [...places.value]; next[place] = Number(event.target.value); places.value = next; }}>
      ${batch.sweep[axis].map((/** @type {any} */ each, /** @type {number} */ i) => html`<option value=${i}>${valueText(each)}</option>`)}</select></label>`)}</div>`}
    <div class="panel axes" tabindex="0" role="region" aria-label=${text.sheet}><table aria-rowcount=${rows.length + 1} aria-colcount=${columns.length + 1}>
      <thead><tr><td><code>${down}</code> ↓ <code>${across}</code> →</td>${space(inColumns.first, 'width')}${shownColumns.map((column) => html`<th key=${column} scope="col" class="number">${valueText(columns[column])}</th>`)}${space(columns.length - inColumns.last, 'width')}</tr></thead>
      <tbody ref=${body}>${spaceRow(inRows.first)}${shownRows.map((row) => html`<tr key=${row} aria-rowindex=${row + 2}><th scope="row" class="number">${valueText(rows[row])}</th>${space(inColumns.first, 'width')}
        ${shownColumns.map((column) => html`<td key=${at(row, column)}><${Cell} job=${jobs.get(at(row, column))} index=${at(row, column)} label="" many=${batch.size > MANY} /></td>`)}</tr>`)}${spaceRow(rows.length - inRows.last)}</tbody></table></div>`;
}

/** @param {any} value */
const valueText = (value) => JSON.stringify(value).slice(0, 40);

/** Changes of a frame. @param {Job | undefined} job @param {number} index */
function frameText(job, index) {
  if (!job?.variation?.values) return text.frame(index);
  const short = (/** @type {any} */ value) => typeof value === 'number' ? String(Number(value.toPrecision(5))) : JSON.stringify(value);
  return job.variation.values.name ? job.name : leaves(job.variation.values).map(([pointer, value]) => `${pointer.slice(1)} ${short(value)}`).join(', ').slice(0, 60) || text.frame(index);
}

/** One job of the sheet, or its empty place. @param {{job: Job | undefined, index: number, label: string, many: boolean}} properties */
function Cell({job, index, label, many}) {
  if (!job) return html`<span class="cell" data-index=${index}><span class="thumb"></span><span class="dim">${label || text.gone}</span></span>`;
  const failed = job.state === 'failed', retry = () => attempt(async () => { await postJson(`/v1/jobs/${job.id}/retry`, undefined); });
  const name = `${text.frame(index)}, ${words.states[/** @type {'failed'} */ (job.state)]}`;
  return html`<span class="cell" data-index=${index} data-id=${job.id} data-state=${job.state}><a href=${`#/jobs/${job.id}`} aria-label=${label ? `${label}, ${name}` : name}><${Thumbnail} key=${job.id} job=${job} side=${many ? SMALL_SIDE : THUMBNAIL_SIDE} /></a>
    ${label && html`<span class="number line">${label}</span>`}
    ${job.state === 'running' ? html`<progress max="1" value=${job.progress} aria-label=${words.queue.columns.progress}></progress>`
      : job.state === 'succeeded' ? html`<span class="dim number">${job.report ? duration(job.report.time_ms.trace / 1000) : ''}</span>` : html`<span class="ended">${failed ? html`<span class="reason line" title=${job.problem?.detail}><${Icon} name="failed" /> ${job.problem?.detail}</span>` : html`<${State} state=${job.state} />`}
          ${failed && mayWrite.value && html`<button onClick=${retry}>${words.queue.retry}</button>`}</span>`}</span>`;
}
