/** The trade-off of one scene: error against time at many settings, and what to do with one of them. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect} from 'preact/hooks';
import {mayWrite, postJson} from './api.js';
import {documentDifference} from './pointers.js';
import {duration, figure} from './format.js';
import {Actions} from './job-actions.js';
import {documentOf, useJob} from './job-source.js';
import {errorText, nameOf, Plot, time} from './measure-plot.js';
import {attempt, Failure, State} from './parts.js';
import {applied, changesTo} from './pointers.js';
import {go, route, setQuery} from './routes.js';
import {figures} from './store.js';
import {words} from './words.js';

const text = words.measure;

/** @typedef {import('./measure-plot.js').Point} Point */
/** @typedef {{width: number, height: number, alone: boolean, reference: {samples: number, error: number}, points: Point[], pareto_front: number[], model_error: {standard_error?: number} | null, advice: string[]}} Measurement */

/** The point of the front that is best within a limit; -1: none is. Claims count, since a true error may be unknown. @param {Measurement} measurement @param {'seconds' | 'claimed'} limited @param {number} limit */
export function cheapest({points, pareto_front}, limited, limit) {
  const other = limited === 'seconds' ? 'claimed' : 'seconds';
  const within = pareto_front.filter((index) => points[index][limited] <= limit);
  return within.reduce((best, index) => best < 0 || points[index][other] < points[best][other] ? index : best, -1);
}

/** @param {{id: string}} properties */
export function Measure({id}) {
  const {job, etag, problem} = useJob(id);
  const scene = useSignal('');
  useEffect(() => { documentOf(id).then((value) => { scene.value = value; }, () => undefined); }, [id]);
  const value = job.value;
  if (!value) return html`<div class="page"><h1>${words.titles.measure}</h1>${problem.value ? html`<${Failure} problem=${problem.value} />` : html`<p class="dim">${words.loading}</p>`}</div>`;
  if (value.kind !== 'measure') return html`<div class="empty"><h1>${words.titles.measure}</h1><p>${text.notMeasured}</p><a class="button" href=${`#/jobs/${id}`}>${words.titles.jobs}</a></div>`;
  /** @type {Measurement | null} */
  const measurement = value.measurement;
  const queue = figures.value, isAlone = queue?.jobs.running === 1 && queue.jobs.queued === 0;
  const left = value.eta_s || (isAlone && queue.eta_s);
  const isRunning = value.state === 'running', hasPoints = !!measurement && measurement.points.length > 0;
  return html`<div class="page measure">
    <header class="heading"><h1>${words.titles.measure}: ${value.name || words.queue.untitled}</h1> <${State} state=${value.state} />
      ${isRunning && html`<span class="number">${Math.floor(value.progress * 100)} % ${left ? html`<span class="dim">${words.job.left(duration(left))}</span>` : ''}</span>`}
      <span class="spring"></span><a class="button" href=${`#/jobs/${id}`}>${words.titles.jobs}</a><${Actions} job=${job} etag=${etag} /></header>
    ${isRunning && html`<progress max="1" value=${value.progress} aria-label=${words.queue.columns.progress}></progress>`}
    ${value.problem && html`<p class="note bad"><strong>${value.problem.code}</strong>: ${value.problem.detail}</p>`}
    ${measurement && !measurement.alone && html`<p class="note">${text.notAlone}</p>`}
    ${hasPoints ? html`<${Result} job=${value} measurement=${/** @type {Measurement} */ (measurement)} scene=${scene.value} />`
      : html`<div class="empty"><h2>${isRunning ? text.reference : words.job.noImage[/** @type {'queued'} */ (value.state)]}</h2><p>${value.state === 'queued' || isRunning ? text.soon : ''} ${isRunning ? text.bell : ''}</p></div>`}
  </div>`;
}

/** @param {{job: Record<string, any>, measurement: Measurement, scene: string}} properties */
function Result({job, measurement, scene}) {
  const named = Number(route.value.query.get('point') ?? NaN);
  const {points, pareto_front, reference, advice} = measurement;
  const selected = points[named] ? named : cheapest(measurement, 'claimed', 1);
  const select = (/** @type {number} */ index) => setQuery({point: String(index)});
  return html`<div class="measured">
    <section class="panel"><${Plot} measurement=${measurement} selected=${selected} select=${select} />
      <p class="dim">${text.of(points.length, measurement.width, measurement.height)} ${text.referenceIs(reference.samples, figure(reference.error))}</p></section>
    <section class="panel choice"><${LimitFields} measurement=${measurement} select=${select} />
      ${points[selected] ? html`<${Chosen} job=${job} point=${points[selected]} scene=${scene} />` : html`<p class="dim">${text.choose}</p>`}</section>
    <section class="panel"><h2>${text.points}</h2><${Table} points=${points} front=${pareto_front} selected=${selected} select=${select} /></section>
    ${advice.length > 0 && html`<section class="panel"><h2>${text.advice}</h2><ul class="advice">${advice.map((sentence) => html`<li>${sentence}</li>`)}</ul></section>`}
  </div>`;
}

/** Fields for the time that the user has, or the error that the user needs. @param {{measurement: Measurement, select: (index: number) => void}} properties */
function LimitFields({measurement, select}) {
  const answer = useSignal('');
  const choose = (/** @type {'seconds' | 'claimed'} */ limited, /** @type {string} */ limit) => {
    const index = cheapest(measurement, limited, Number(limit));
    answer.value = limit === '' || index >= 0 ? '' : text.none[limited];
    if (limit !== '' && index >= 0) select(index);
  };
  const field = (/** @type {'seconds' | 'claimed'} */ limited) => html`<label>${text.limit[limited]} <input type="number" min="0" step="any" data-limit=${limited}
    onInput=${(/** @type {any} */ event) => choose(limited, event.target.value)} /> ${text.unit[limited]}</label>`;
  return html`<div class="form-fields">${field('seconds')} ${field('claimed')}</div><p class="dim" role="status">${answer.value}</p>`;
}

/** A setting: its numbers, what it changes, and what to do with it. @param {{job: Record<string, any>, point: Point, scene: string}} properties */
function Chosen({job, point, scene}) {
  const parsed = scene ? JSON.parse(scene) : {};
  const rows = documentDifference({accuracy: parsed.accuracy ?? {}}, {accuracy: point.settings}).filter(({a, b}) => (a || '{}') !== (b || '{}'));
  const changed = (/** @type {string} */ document, /** @type {string[]} */ path, /** @type {any} */ to) => applied(document, changesTo(document, path, to));
  const render = () => attempt(async () => { go(`#/jobs/${(await postJson('/v1/jobs', changed(scene, ['accuracy'], point.settings))).id}`); });
  const reference = job.artifacts.find((/** @type {any} */ each) => each.name === 'reference.exr');
  const compare = () => attempt(async () => {  // linear like the reference, whatever the exposure
    const document = changed(changed(scene, ['accuracy'], point.settings), ['output', 'formats'], [...new Set([...parsed.output?.formats ?? ['png'], 'exr'])]);
    go(`#/compare?a=${job.id}/reference.exr&b=${(await postJson('/v1/jobs', document)).id}/image.exr`);
  });
  return html`<div class="chosen"><strong>${nameOf(point)}</strong>
    <dl class="facts-list"><dt>${text.time}</dt><dd class="number">${time(point.seconds)}</dd><dt>${text.error}</dt><dd class="number">${text.levels(errorText(point, 'error'))}</dd>
      <dt>${text.claimed}</dt><dd class="number">${text.levels(figure(point.claimed))}${point.broken ? html` <span class="bad">${text.broken}</span>` : ''}</dd>
      ${point.model_error !== null && point.total_error !== null && html`<dt>${text.modelError}</dt><dd class="number">${text.levels(errorText(point, 'model_error'))}</dd>
        <dt>${text.totalError}</dt><dd class="number">${text.levels(errorText(point, 'total_error'))}</dd>`}</dl>
    <table class="plain"><thead><tr><th>${text.change}</th><th>${text.now}</th><th>${text.then}</th></tr></thead><tbody>
      ${rows.map(({pointer, a, b}) => html`<tr><td><code>${pointer}</code></td><td class="number">${a}</td><td class="number">${b}</td></tr>`)}
      ${rows.length === 0 && html`<tr><td colspan="3" class="dim">${text.same}</td></tr>`}</tbody></table>
    ${mayWrite.value && scene && html`<div class="buttons"><button class="primary" onClick=${render}>${text.render}</button>
      ${reference && html`<button onClick=${compare}>${text.compare}</button>`}
      <a class="button" href=${`#/edit/${job.id}?accuracy=${encodeURIComponent(JSON.stringify(point.settings))}`}>${text.use}</a></div>`}</div>`;
}

/** The points of the plot as a table. @param {{points: Point[], front: number[], selected: number, select: (index: number) => void}} properties */
function Table({points, front, selected, select}) {
  const by = useSignal(/** @type {'name' | 'seconds' | 'error' | 'claimed' | 'model_error' | 'total_error'} */ ('seconds')), falls = useSignal(false);
  const hasModels = points.some(({model_error}) => model_error !== null);
  const keyOf = (/** @type {number} */ index) => by.value === 'name' ? index : points[index][by.value] ?? -1;
  const order = points.map((_, index) => index).sort((a, b) => (falls.value ? -1 : 1) * (keyOf(a) - keyOf(b)) || a - b);
  const sort = (/** @type {typeof by.value} */ name) => { falls.value = by.value === name && !falls.value; by.value = name; };
  const head = (/** @type {typeof by.value} */ name, /** @type {string} */ label) => html`<th class=${name === 'name' ? '' : 'right'} aria-sort=${by.value === name ? falls.value ? 'descending' : 'ascending' : undefined}>
    <button class="link" onClick=${() => sort(name)}>${label}${by.value === name ? falls.value ? ' ↓' : ' ↑' : ''}</button></th>`;
  return html`<table class="plain points"><thead><tr>${head('name', text.setting)}${head('seconds', text.time)}${head('error', text.error)}${head('claimed', text.claimed)}
    ${hasModels && html`${head('model_error', text.modelError)}${head('total_error', text.totalError)}`}</tr></thead><tbody>
    ${order.map((index) => html`<tr key=${index} data-point=${index} aria-current=${index === selected ? 'true' : undefined}><td><button class="link" onClick=${() => select(index)}>${nameOf(points[index])}</button>
      ${front.includes(index) && html`<span class="chip">${text.onFront}</span>`}</td><td class="right number">${time(points[index].seconds)}</td><td class="right number">${errorText(points[index], 'error')}</td>
      <td class="right number">${figure(points[index].claimed)}${points[index].broken ? html` <span class="bad">!</span>` : ''}</td>
      ${hasModels && html`<td class="right number">${errorText(points[index], 'model_error')}</td><td class="right number">${errorText(points[index], 'total_error')}</td>`}</tr>`)}</tbody></table>`;
}
