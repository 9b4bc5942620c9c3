/** The queue: counts as filter, rows of jobs, selection and what can be done with it. */
import {signal, useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useMemo, useRef} from 'preact/hooks';
import {getJson, mayWrite, postJson} from './api.js';
import {age, count, duration, figure, levels} from './format.js';
import {JobList} from './job-list.js';
import {addKeys} from './keys.js';
import {announce, attempt, Bell, Dialog, Entry, Failure, missedTarget, State, Thumbnail} from './parts.js';
import {go, route, routeOf, setQuery} from './routes.js';
import {FileButton, Gallery, openDocuments} from './scenes.js';
import {figures, listen} from './store.js';
import {patchText, variedPointers} from './sweep.js';
import {words} from './words.js';

const ROW = 44, ROWS_MAX = 60, SEARCH_MS = 200, SAMPLE = 4, STATES = /** @type {const} */ (['queued', 'running', 'succeeded', 'failed', 'cancelled']);
const text = words.queue;

/** @typedef {Record<string, any>} Job */

const now = signal(Date.now());
setInterval(() => { if (document.visibilityState === 'visible') now.value = Date.now(); }, 5000);

/** "0.83 of 1 level", or "" before there is a report. @param {Job} job */
export function errorText(job) {
  const error = job.report?.error;
  if (!error) return '';
  return error.target ? text.of(figure(error.estimate), levels(error.target)) : levels(error.estimate);
}

/** The job or batch that was opened last, or that the keys have moved to: rows move as jobs arrive. */
const current = signal('');

export function Queue() {
  const state = route.value.query.get('state') || '', search = route.value.query.get('q') || '', batch = route.value.query.get('batch') || '';
  const filter = useMemo(() => {
    /** @type {Record<string, string>} */
    const made = {};
    if (state) made.state = state;
    if (search) made.q = search;
    if (batch) made.batch = batch;
    return made;
  }, [state, search, batch]);
  const list = useMemo(() => new JobList(filter, !batch), [filter]);
  useEffect(() => () => list.close(), [list]);
  const selected = useSignal(/** @type {Set<string>} */ (new Set()));
  useEffect(() => { selected.value = new Set(); }, [list]);
  useEffect(() => listen({reload: () => undefined, event: ({id, state: now}) => {
    if (now === 'removed' && selected.value.has(id)) selected.value = new Set([...selected.value].filter((each) => each !== id));
  }}), []);
  const field = useRef(/** @type {HTMLInputElement | null} */ (null));
  const typing = useRef(0), find = (/** @type {string} */ words) => {
    clearTimeout(typing.current);
    if (route.value.page === 'queue') setQuery({q: words || null});  // the field changes as it is left, too
  };
  useEffect(() => {
    if (route.value.query.get('q') === '') field.current?.focus();  // "/" on another page
    return () => clearTimeout(typing.current);
  }, [route.value]);
  useEffect(() => addKeys({'/': () => field.current?.focus()}), []);
  list.version.value;
  const empty = !list.loading.value && list.order.length === 0 && !list.problem.value;
  return html`<div class="page queue">
    <div class="tools">
      <h1>${words.titles.queue}</h1>
      <div class="counts" role="group" aria-label=${text.columns.state}>
        <${Count} name="" label=${text.all} state=${state} />
        ${STATES.map((name) => html`<${Count} name=${name} label=${words.states[name]} state=${state} />`)}
      </div>
      <span class="spring"></span>
      <${Entry} field=${field} type="search" placeholder=${text.searchKey} aria-label=${text.search} value=${search}
        onInput=${(/** @type {any} */ event) => { const {value} = event.target; clearTimeout(typing.current); typing.current = window.setTimeout(() => find(value), SEARCH_MS); }}
        onChange=${(/** @type {any} */ event) => find(event.target.value)} />
    </div>
    <${Failure} problem=${list.problem.value} />
    ${empty ? html`<${Empty} filtered=${Object.keys(filter).length > 0} />` : html`<${Rows} list=${list} selected=${selected} />`}
    <${BulkBar} list=${list} filter=${filter} selected=${selected} />
  </div>`;
}

/** @param {{name: '' | typeof STATES[number], label: string, state: string}} properties */
function Count({name, label, state}) {
  const jobs = figures.value?.jobs;
  const number = jobs && (name ? jobs[name] : STATES.reduce((sum, each) => sum + (jobs[each] || 0), 0));
  return html`<button class="count" aria-pressed=${state === name} onClick=${() => setQuery({state: name || null})}>
    ${name ? html`<${State} state=${name} />` : label} <span class="number">${count(number ?? null)}</span></button>`;
}

/** @param {{filtered: boolean}} properties */
function Empty({filtered}) {
  if (filtered) {
    return html`<div class="empty"><h2>${text.nothing}</h2><p>${text.nothingText}</p>
      <button onClick=${() => setQuery({state: null, q: null, batch: null})}>${text.clear}</button></div>`;
  }
  return html`<div class="empty first"><h2>${text.empty}</h2><p>${text.emptyText}</p>
    ${mayWrite.value && html`<${Gallery} /><p>${words.scenes.drop}</p><div class="buttons"><a class="button primary" href="#/new">${text.openPlayground}</a>
      <${FileButton} accept=".json" onFiles=${(/** @type {File[]} */ files) => openDocuments(files)}>${words.scenes.open}</${FileButton}></div>`}
    <p>${words.scenes.programs}: <a href="/docs">${words.scenes.programsText}</a></p></div>`;
}

/** @param {{list: JobList, selected: import('@preact/signals').Signal<Set<string>>}} properties */
function Rows({list, selected}) {
  const box = useRef(/** @type {HTMLElement | null} */ (null));
  const range = useSignal({first: 0, last: 30});
  const anchor = useRef('');
  const measure = () => {
    const element = box.current;
    if (!element) return;
    const first = Math.max(0, Math.floor(element.scrollTop / ROW) - 8);
    const last = Math.min(first + ROWS_MAX, Math.ceil((element.scrollTop + element.clientHeight) / ROW) + 8);
    if (first !== range.value.first || last !== range.value.last) range.value = {first, last};
    if (last > list.order.length - 40) list.more();
  };
  useEffect(() => {
    measure();
    const observer = new ResizeObserver(measure);
    if (box.current) observer.observe(box.current);
    return () => observer.disconnect();
  }, [list]);
  list.version.value;
  const {first, last} = range.value, ids = list.order.slice(first, last);
  useEffect(() => { list.refresh(ids); });

  const toggle = (/** @type {string} */ id, /** @type {boolean} */ extend) => {
    const next = new Set(selected.value), index = list.order.indexOf(id), from = list.order.indexOf(anchor.current);
    if (extend && from >= 0) {
      const [low, high] = [Math.min(from, index), Math.max(from, index)];
      for (const each of list.order.slice(low, high + 1)) next.add(each);
    } else if (!next.delete(id)) next.add(id);
    anchor.current = id;
    selected.value = next;
  };
  const move = (/** @type {number} */ step) => {
    const index = Math.max(0, Math.min(list.order.length - 1, list.order.indexOf(current.value) + step));
    current.value = list.order[index] ?? '';
    const element = box.current, top = index * ROW;
    if (element && top < element.scrollTop) element.scrollTop = top;
    if (element && top + 2 * ROW > element.scrollTop + element.clientHeight) element.scrollTop = top + 2 * ROW - element.clientHeight;
  };
  useEffect(() => addKeys({
    'j': () => move(1), 'k': () => move(-1), 'x': () => { if (list.order.includes(current.value)) toggle(current.value, false); },
    'Enter': () => { if (list.order.includes(current.value)) go(routeOf(/** @type {any} */ (list.jobs.get(current.value)))); },
  }), [list]);
  const rowOf = (/** @type {string} */ id) => list.jobs.get(id)?.kind === 'batch' ? BatchRow : Row;

  const columns = text.columns;
  return html`<div class="rows panel" ref=${box} onScroll=${measure} tabindex="-1">
    <table aria-rowcount=${list.order.length + 1} aria-busy=${list.loading.value}>
      <thead><tr>${mayWrite.value && html`<th class="c-check"></th>`}<th class="c-thumb"></th><th class="c-name" scope="col">${columns.name}</th><th class="c-state" scope="col">${columns.state}</th>
        <th class="c-progress" scope="col">${columns.time}</th><th class="c-error" scope="col">${columns.error}</th><th class="c-size" scope="col">${columns.size}</th>
        <th class="c-priority" scope="col">${columns.priority}</th><th class="c-age" scope="col">${columns.age}</th></tr></thead>
      <tbody>
        ${first > 0 && html`<tr class="space" aria-hidden="true" style=${{height: `${first * ROW}px`}}></tr>`}
        ${ids.map((id, offset) => html`<${rowOf(id)} key=${id} job=${list.jobs.get(id)} index=${first + offset} isCurrent=${current.value === id}
          isSelected=${selected.value.has(id)} toggle=${toggle} />`)}
        ${last < list.order.length && html`<tr class="space" aria-hidden="true" style=${{height: `${(list.order.length - last) * ROW}px`}}></tr>`}
      </tbody>
    </table>
  </div>`;
}

/** @typedef {{job: Job, index: number, isCurrent: boolean, isSelected: boolean, toggle: (id: string, extend: boolean) => void}} RowProperties */

/** A row that opens its job or batch. @param {RowProperties & {children?: any}} properties */
function Line({job, index, isCurrent, isSelected, toggle, children}) {
  const open = (/** @type {any} */ event) => {
    if (event.target.closest('input')) return;
    current.value = job.id;
    if (!event.target.closest('a')) event.shiftKey && mayWrite.value ? toggle(job.id, true) : go(routeOf(/** @type {any} */ (job)));
  };
  return html`<tr aria-rowindex=${index + 2} aria-selected=${isSelected} class=${isCurrent ? 'current' : ''} data-id=${job.id} onClick=${open}>
    ${mayWrite.value && html`<td class="c-check"><input type="checkbox" aria-label=${text.select(job.name || text.untitled)} checked=${isSelected} onClick=${(/** @type {any} */ event) => toggle(job.id, event.shiftKey)} /></td>`}
    ${children}<td class="c-age number">${age(job.created_at, now.value)}</td></tr>`;
}

/** Differences of a job from others of its name: its values in a batch, otherwise its labels. @param {Job} job */
function chipsOf(job) {
  const values = patchText(job.variation?.values);
  return [...values, ...values.length > 0 ? [] : Object.entries(job.labels || {}).map(([label, value]) => `${label}: ${value}`), ...job.owner ? [job.owner] : []].slice(0, 4);
}

/** @param {RowProperties} properties */
function Row({job, ...line}) {
  const isRunning = job.state === 'running', isCached = job.state === 'succeeded' && job.attempt === 0;
  const percent = Math.floor(job.progress * 100);
  return html`<${Line} job=${job} ...${line}>
    <td class="c-thumb"><${Thumbnail} job=${job} /></td>
    <td class="c-name"><a href=${routeOf(/** @type {any} */ (job))}>${job.name || text.untitled}</a> ${job.kind === 'measure' && html`<span class="chip">measure</span>`}
      ${chipsOf(job).map((each) => html`<span class="chip">${each}</span>`)}</td>
    <td class="c-state"><${State} state=${job.state} job=${job} /></td>
    <td class="c-progress number">${isRunning ? html`<progress max="1" value=${job.progress} aria-label=${text.columns.progress}></progress>
      <span>${percent} % ${job.eta_s ? html`<span class="dim">${duration(job.eta_s)}</span>` : ''}</span>`
      : job.report ? html`<span class="dim">${isCached ? text.cached : duration(job.report.time_ms.trace / 1000)}</span>` : ''}</td>
    <td class=${`c-error number ${missedTarget(job) ? 'missed' : ''}`}>${errorText(job)}</td>
    <td class="c-size number">${job.image ? `${job.image.width} × ${job.image.height}` : ''}</td>
    <td class="c-priority number">${job.priority}</td>
  </${Line}>`;
}

/** All jobs of a batch, with the image of one of them. @param {RowProperties} properties */
function BatchRow({job: batch, ...line}) {
  const jobs = useSignal(/** @type {Job[]} */ ([])), done = batch.jobs.succeeded || 0, failed = batch.jobs.failed || 0;
  useEffect(() => {
    const closing = new AbortController();
    getJson(`/v1/jobs?batch=${batch.id}&limit=${SAMPLE}${done > 0 ? '&state=succeeded' : ''}`, {signal: closing.signal}).then((page) => { jobs.value = page.items; }, () => undefined);
    return () => closing.abort();
  }, [batch.id, done > 0, batch.state]);
  const varied = batch.sweep ? Object.entries(batch.sweep).map(([pointer, values]) => text.axis(pointer.slice(1), values.length, JSON.stringify(values[0]).slice(0, 12), JSON.stringify(values.at(-1)).slice(0, 12)))
    : variedPointers(jobs.value.map((each) => each.variation?.values)).map((pointer) => pointer.slice(1));
  return html`<${Line} job=${batch} ...${line}>
    <td class="c-thumb"><span class="pile">${jobs.value[0] && html`<${Thumbnail} key=${jobs.value[0].id} job=${jobs.value[0]} />`}</span></td>
    <td class="c-name"><a href=${routeOf(/** @type {any} */ (batch))}>${batch.name || text.untitled}</a> <span class="chip">${text.images(batch.size)}</span>
      ${varied.slice(0, 3).map((each) => html`<span class="chip">${each}</span>`)}</td>
    <td class="c-state"><${State} state=${batch.state} /></td>
    <td class="c-progress number">${batch.progress < 1 ? html`<progress max="1" value=${batch.progress} aria-label=${text.columns.progress}></progress><span>${Math.floor(batch.progress * 100)} %</span>` : ''}</td>
    <td class="c-error number">${failed > 0 ? text.failed(failed) : ''}</td>
    <td class="c-size number">${jobs.value[0]?.image ? `${jobs.value[0].image.width} × ${jobs.value[0].image.height}` : ''}</td>
    <td class="c-priority number">${jobs.value[0]?.priority ?? ''}</td>
  </${Line}>`;
}

/** Actions on the selected jobs. @param {{list: JobList, filter: Record<string, string>, selected: import('@preact/signals').Signal<Set<string>>}} properties */
function BulkBar({list, filter, selected}) {
  /** The selection that stands for all jobs of the filter, until it changes. */
  const widened = useSignal(/** @type {Set<string> | null} */ (null)), everything = widened.value === selected.value;
  const proposed = useSignal(/** @type {{selection: Set<string>, action: 'cancel' | 'remove' | 'retry', bodies: any[], matched: number, refused: number} | null} */ (null));
  /** A question is about the selection of its time. */
  const confirmed = proposed.value?.selection === selected.value ? proposed.value : null;
  const clear = () => { selected.value = new Set(); };
  const isBatch = (/** @type {string} */ id) => list.jobs.get(id)?.kind === 'batch';
  /** The selected jobs: all of the filter, or some by their ids and those of batches. @param {Set<string>} selection */
  const parts = (selection) => {
    if (widened.value === selection) return [{filter}];
    const ids = [...selection].filter((id) => !isBatch(id));
    return [...ids.length > 0 ? [{ids}] : [], ...[...selection].filter(isBatch).map((batch) => ({filter: {batch}}))];
  };
  const bulk = async (/** @type {any[]} */ bodies) => {
    const replies = await Promise.all(bodies.map((body) => postJson('/v1/jobs/bulk', body)));
    const sum = (/** @type {string} */ name) => replies.reduce((total, reply) => total + reply[name], 0);
    return {matched: sum('matched'), done: sum('done'), refused: replies.flatMap((reply) => reply.refused)};
  };
  const propose = (/** @type {'cancel' | 'remove' | 'retry'} */ action) => attempt(async () => {
    const selection = selected.value, bodies = parts(selection).map((part) => ({action, ...part}));
    const trial = await bulk(bodies.map((body) => ({...body, dry_run: true})));
    proposed.value = {selection, action, bodies, matched: trial.matched, refused: trial.refused.length};
  });
  const run = () => attempt(async () => {
    if (!proposed.value) return;
    const {action, bodies} = proposed.value;
    proposed.value = null;
    const {done, refused} = await bulk(bodies);
    announce(text.outcome(text[action], done, refused.length));
    selected.value = new Set(refused.map((/** @type {{id: string}} */ each) => each.id).filter((/** @type {string} */ id) => list.order.includes(id)));
    list.scheduleReload();
  });
  useEffect(() => addKeys({
    'c': () => { if (selected.value.size > 0) propose('cancel'); }, 'r': () => { if (selected.value.size > 0) propose('retry'); }, 'Esc': clear,
  }), [list]);
  if (selected.value.size === 0 || !mayWrite.value) return null;
  const canSelectAll = Object.keys(filter).length > 0 && list.order.length > selected.value.size;
  const shown = new Set(list.order), summary = text.selected(selected.value.size, [...selected.value].filter((id) => !shown.has(id)).length);
  return html`<div class="bulk" role="toolbar" aria-label=${summary}>
    <strong class="number">${everything ? text.allMatching : summary}</strong>
    ${canSelectAll && !everything && html`<button class="quiet" onClick=${() => { widened.value = selected.value; }}>${text.allMatching}</button>`}
    ${selected.value.size === 2 && ![...selected.value].some(isBatch) && html`<a class="button" href=${`#/compare?a=${[...selected.value][1]}&b=${[...selected.value][0]}`}>${text.compare}</a>`}
    <${Bell} ids=${[...selected.value].map((id) => isBatch(id) ? `batch/${id}` : id)} label=${words.bell.ringAll} />
    <button onClick=${() => propose('cancel')}>${text.cancel}</button>
    <button onClick=${() => propose('retry')}>${text.retry}</button>
    <button class="danger" onClick=${() => propose('remove')}>${text.remove}</button>
    <button class="quiet" onClick=${clear}>${text.clearSelection}</button>
    <${Dialog} open=${confirmed !== null} onClose=${() => { proposed.value = null; }} title=${text.columns.state}>${confirmed && html`<div class="stack">
      <h2>${text.confirm[confirmed.action](confirmed.matched - confirmed.refused)}</h2>
      ${confirmed.refused > 0 && html`<p class="dim">${text.notPossible(confirmed.refused)}</p>`}
      <div class="row"><button onClick=${() => { proposed.value = null; }}>${text.back}</button>
        <button class="primary" disabled=${confirmed.matched === confirmed.refused} onClick=${run}>${text.doIt[confirmed.action]}</button></div></div>`}</${Dialog}>
  </div>`;
}
