/** The contact sheet of a batch: its jobs along the axes of the sweep. Only the cells in view exist. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useMemo, useRef} from 'preact/hooks';
import {getJson, mayWrite, postJson} from './api.js';
import {duration} from './format.js';
import {attempt, Icon, missedTarget, State, Thumbnail} from './parts.js';
import {indexOf, leaves, patchText, shortValue, sweepOfPatches, variedPointers} from './sweep.js';
import {words} from './words.js';

/** Px, as in app.css; the text below an image has the rest of the height. */
const CELL = {width: 168, gap: 10, label: 18, text: 34, image: {least: 48, most: 126}};
/** Lines beyond those in view. */
const BEYOND = 1;
const THUMBNAIL_SIDE = 256, SMALL_SIDE = 128, MANY = 100;
const text = words.batches;

/** @typedef {Record<string, any>} Batch */
/** @typedef {Record<string, any>} Job */
/** @typedef {import('./job-list.js').JobList} JobList */

/** The lines of a box that are in view, and one more on each side. @param {{current: HTMLElement | null}} box @param {number} count @param {number} pitch px from one line to the next @param {boolean} [sideways] */
function useWindow(box, count, pitch, sideways = false) {
  const range = useSignal({first: 0, last: Math.min(count, 4)});
  useEffect(() => {
    const measure = () => {
      if (!box.current) return;
      const frame = box.current.getBoundingClientRect(), begin = sideways ? frame.left : frame.top, length = sideways ? innerWidth : innerHeight;
      const within = (/** @type {number} */ line) => Math.max(0, Math.min(count, line));
      const first = within(Math.floor(-begin / pitch) - BEYOND), last = within(Math.ceil((length - begin) / pitch) + BEYOND);
      if (first !== range.value.first || last !== range.value.last) range.value = {first, last};
    };
    measure();
    document.addEventListener('scroll', measure, true);  // of any box around it
    addEventListener('resize', measure);
    return () => { document.removeEventListener('scroll', measure, true); removeEventListener('resize', measure); };
  }, [count, pitch]);
  return {first: Math.min(range.value.first, count), last: Math.min(range.value.last, count)};
}

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

/** The sweep of a batch, or what its patches vary once all of them are known. @param {Batch} batch @param {Map<number, Job>} jobs */
function useSweep(batch, jobs) {
  const base = useSignal(/** @type {any} */ (null)), first = jobs.get(0)?.id, isWhole = jobs.size === batch.size && !batch.sweep;
  useEffect(() => { if (isWhole) getJson(`/v1/jobs/${first}/scene`).then((scene) => { base.value = scene; }, () => undefined); }, [first, isWhole]);
  return useMemo(() => {
    if (!base.value || !isWhole) return {sweep: batch.sweep, pointers: null};
    const patches = Array.from({length: batch.size}, (_, index) => jobs.get(index)?.variation?.values), isKnown = patches.every((each) => each);
    return {sweep: isKnown ? sweepOfPatches(patches, base.value) : null, pointers: isKnown ? variedPointers(patches, new Map(leaves(base.value))) : null, base: new Map(leaves(base.value))};
  }, [base.value, isWhole, batch.sweep]);
}

/** @param {{batch: Batch, list: JobList, jobs: Map<number, Job>}} properties */
export function Sheet({batch: written, list, jobs}) {
  const {sweep, pointers, base} = useSweep(written, jobs), batch = {...written, sweep};
  const axes = Object.keys(sweep || {}), image = jobs.get(0)?.image;
  const height = image ? Math.round(Math.max(CELL.image.least, Math.min(CELL.image.most, CELL.width * image.height / image.width))) : CELL.image.most;
  const label = (/** @type {number} */ index) => frameText(jobs.get(index), index, pointers, base);
  const refresh = (/** @type {number[]} */ indices) => { list.refresh(indices.flatMap((index) => jobs.get(index)?.id ?? [])); };
  const shared = {batch, jobs, refresh, height: height + CELL.text + (axes.length < 2 ? CELL.label : 0)};
  return html`<div class="sheets" style=${{'--image': `${height}px`}}>${axes.length < 2 ? html`<${Sequence} ...${shared} axis=${axes[0]} label=${label} />` : html`<${Axes} ...${shared} />`}</div>`;
}

/** @param {{batch: Batch, jobs: Map<number, Job>, refresh: (indices: number[]) => void, height: number, axis: string | undefined, label: (index: number) => string}} properties */
function Sequence({batch, jobs, refresh, height, axis, label: named}) {
  const box = useRef(/** @type {HTMLElement | null} */ (null)), columns = useSignal(1);
  useEffect(() => {
    const observer = new ResizeObserver(([{contentRect}]) => { columns.value = Math.max(1, Math.floor((contentRect.width + CELL.gap) / (CELL.width + CELL.gap))); });
    if (box.current) observer.observe(box.current);
    return () => observer.disconnect();
  }, []);
  const rows = Math.ceil(batch.size / columns.value), pitch = height + CELL.gap;
  const {first, last} = useWindow(box, rows, pitch), begin = first * columns.value;
  const shown = Array.from({length: Math.max(0, Math.min(batch.size, last * columns.value) - begin)}, (_, i) => begin + i);
  useEffect(() => refresh(shown));
  const label = (/** @type {number} */ index) => axis ? shortValue(batch.sweep[axis][index]) : named(index);
  return html`${axis && html`<p class="dim"><code>${axis}</code></p>`}
    <div ref=${box} style=${{height: `${rows * pitch - CELL.gap}px`}}>
      <ul class="sheet" aria-label=${text.sheet} style=${{transform: `translateY(${first * pitch}px)`, gridTemplateColumns: `repeat(${columns.value}, minmax(0, 1fr))`}}>${shown.map((index) =>
        html`<li key=${index} aria-posinset=${index + 1} aria-setsize=${batch.size}><${Cell} job=${jobs.get(index)} index=${index} label=${label(index)} many=${batch.size > MANY} /></li>`)}</ul></div>`;
}

/** Two axes as rows and columns, the others as pickers. @param {{batch: Batch, jobs: Map<number, Job>, refresh: (indices: number[]) => void, height: number}} properties */
function Axes({batch, jobs, refresh, height}) {
  const cell = {width: CELL.width, height};
  const places = useSignal(/** @type {number[]} */ ([])), body = useRef(/** @type {HTMLElement | null} */ (null));
  const axes = Object.keys(batch.sweep), [down, across] = axes.slice(-2), others = axes.slice(0, -2);
  const rows = batch.sweep[down], columns = batch.sweep[across];
  const at = (/** @type {number} */ row, /** @type {number} */ column) => indexOf(batch.sweep, [...others.map((_, axis) => places.value[axis] || 0), row, column]);
  const inRows = useWindow(body, rows.length, height + CELL.gap), inColumns = useWindow(body, columns.length, CELL.width + CELL.gap, true);
  const span = (/** @type {{first: number, last: number}} */ {first, last}) => Array.from({length: last - first}, (_, i) => first + i);
  const [shownRows, shownColumns] = [span(inRows), span(inColumns)];
  useEffect(() => refresh(shownRows.flatMap((row) => shownColumns.map((column) => at(row, column)))));
  /** The place of lines that are out of view. @param {number} lines @param {'width' | 'height'} way */
  const space = (lines, way) => lines > 0 && html`<td aria-hidden="true" style=${{[way]: `${lines * (cell[way] + CELL.gap) - CELL.gap}px`, [`min-${way}`]: `${lines * (cell[way] + CELL.gap) - CELL.gap}px`}}></td>`;
  const spaceRow = (/** @type {number} */ lines) => lines > 0 && html`<tr>${space(lines, 'height')}</tr>`;
  return html`${others.length > 0 && html`<div class="form-fields">${others.map((axis, place) => html`<label><code>${axis}</code> <select value=${places.value[place] || 0}
      onChange=${(/** @type {any} */ event) => { const next = [...places.value]; next[place] = Number(event.target.value); places.value = next; }}>
      ${batch.sweep[axis].map((/** @type {any} */ each, /** @type {number} */ i) => html`<option value=${i}>${shortValue(each)}</option>`)}</select></label>`)}</div>`}
    <div class="panel axes" tabindex="0" role="region" aria-label=${text.sheet}><table aria-rowcount=${rows.length + 1} aria-colcount=${columns.length + 1}>
      <thead><tr><td><code>${down}</code> ↓ <code>${across}</code> →</td>${space(inColumns.first, 'width')}${shownColumns.map((column) => html`<th key=${column} scope="col" class="number">${shortValue(columns[column])}</th>`)}${space(columns.length - inColumns.last, 'width')}</tr></thead>
      <tbody ref=${body}>${spaceRow(inRows.first)}${shownRows.map((row) => html`<tr key=${row} aria-rowindex=${row + 2}><th scope="row" class="number">${shortValue(rows[row])}</th>${space(inColumns.first, 'width')}
        ${shownColumns.map((column) => html`<td key=${at(row, column)}><${Cell} job=${jobs.get(at(row, column))} index=${at(row, column)} label="" many=${batch.size > MANY} /></td>`)}</tr>`)}${spaceRow(rows.length - inRows.last)}</tbody></table></div>`;
}

/** Changes of a frame: at the pointers that vary, if these are known. @param {Job | undefined} job @param {number} index @param {string[] | null} pointers @param {Map<string, any>} [base] */
function frameText(job, index, pointers, base) {
  const values = job?.variation?.values;
  if (job && (!values || values.name)) return values ? job.name : job.labels?.frame?.split(' ')[0] || text.frame(index);
  const known = new Map(leaves(values || {}));
  const written = pointers ? pointers.map((pointer) => `${pointer.slice(1)} ${shortValue(known.has(pointer) ? known.get(pointer) : base?.get(pointer) ?? null)}`) : patchText(values);
  return written.join(', ').slice(0, 80) || text.frame(index);
}

/** One job of the sheet, or its empty place. @param {{job: Job | undefined, index: number, label: string, many: boolean}} properties */
function Cell({job, index, label, many}) {
  if (!job) return html`<span class="cell" data-index=${index}><span class="thumb"></span><span class="dim">${label || text.gone}</span></span>`;
  const failed = job.state === 'failed', retry = () => attempt(async () => { await postJson(`/v1/jobs/${job.id}/retry`, undefined); });
  const name = `${text.frame(index)}, ${words.states[/** @type {'failed'} */ (job.state)]}`;
  return html`<span class="cell" data-index=${index} data-id=${job.id} data-state=${job.state}><a href=${`#/jobs/${job.id}`} aria-label=${label ? `${label}, ${name}` : name}><${Thumbnail} key=${job.id} job=${job} side=${many ? SMALL_SIDE : THUMBNAIL_SIDE} /></a>
    ${label && html`<span class="number line">${label}</span>`}
    ${job.state === 'running' ? html`<progress max="1" value=${job.progress} aria-label=${words.queue.columns.progress}></progress>`
      : job.state === 'succeeded' ? html`<span class=${`number ${missedTarget(job) ? 'missed' : 'dim'}`}>${missedTarget(job) ? words.states.missed : job.report ? duration(job.report.time_ms.trace / 1000) : ''}</span>` : html`<span class="ended">${failed ? html`<span class="reason line" title=${job.problem?.detail}><${Icon} name="failed" /> ${job.problem?.detail}</span>` : html`<${State} state=${job.state} />`}
          ${failed && mayWrite.value && html`<button onClick=${retry}>${words.queue.retry}</button>`}</span>`}</span>`;
}
