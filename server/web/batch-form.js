/** A new batch: one scene, and values for some of its parts. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect} from 'preact/hooks';
import {postJson} from './api.js';
import {count, duration} from './format.js';
import {documentOf} from './job-source.js';
import {Failure} from './parts.js';
import {go, route} from './routes.js';
import {firstText} from './scenes.js';
import {combinations, leaves, shortValue, turntable, valuesOf} from './sweep.js';
import {words} from './words.js';

const POINTERS_MAX = 500, TURN_VIEWS = 24;
const text = words.batches;

/** @typedef {{pointer: string, written: string}} Axis */

/** The sweep that the fields name; null while one of them is not complete. @param {Axis[]} axes */
function sweepOf(axes) {
  /** @type {import('./sweep.js').Sweep} */
  const sweep = {};
  for (const {pointer, written} of axes) {
    const values = valuesOf(written);
    if (!pointer || !values || sweep[pointer]) return null;
    sweep[pointer] = values;
  }
  return sweep;
}

/** The scene of the job that the address names, or the text of the playground. */
export function NewBatch() {
  const document = useSignal(''), seconds = useSignal(/** @type {number | null} */ (null)), problem = useSignal(/** @type {any} */ (null)), name = useSignal('');
  const axes = useSignal(/** @type {Axis[]} */ ([{pointer: '', written: ''}]));
  const job = route.value.query.get('job'), edited = route.value.query.get('edit') || '';
  const busy = useSignal(false);
  useEffect(() => {
    (job ? documentOf(job) : firstText(edited)).then(async (value) => {
      document.value = value;
      if (!value) return;
      const checked = await postJson('/v1/jobs/validate', value);
      seconds.value = checked.estimate?.seconds ?? null;
    }).catch((error) => { problem.value = error; });
  }, [job, edited]);
  /** @type {any} */
  let scene = null;
  try {
    scene = JSON.parse(document.value || 'null');
  } catch {
    // The playground's text is not complete; the sentence below reports it.
  }
  const sweep = sweepOf(axes.value), jobs = sweep ? combinations(sweep) : 0;
  const known = new Map(leaves(scene)), turned = turntable(scene, TURN_VIEWS);
  const turn = () => { axes.value = [...axes.value.filter(({pointer}) => pointer && pointer !== '/camera/position'), {pointer: '/camera/position', written: JSON.stringify(turned).slice(1, -1)}]; };
  const change = (/** @type {number} */ row, /** @type {Partial<Axis>} */ changes) => { axes.value = axes.value.map((each, i) => i === row ? {...each, ...changes} : each); };
  const submit = async (/** @type {Event} */ event) => {
    event.preventDefault();
    if (busy.value) return;
    busy.value = true;
    problem.value = null;
    try {
      const made = await postJson('/v1/batches', `{"name": ${JSON.stringify(name.value || scene.name || '')}, "sweep": ${JSON.stringify(sweep)}, "scene": ${document.value}}`);
      go(`#/batches/${made.id}`);
    } catch (error) {
      problem.value = error;
      busy.value = false;
    }
  };
  const title = html`<h1>${text.create}</h1>`;
  if (!document.value && !problem.value) return html`<div class="page">${title}<p class="dim">${words.loading}</p></div>`;
  if (!scene) return html`<div class="page">${title}<${Failure} problem=${problem.value} /><div class="empty"><h2>${text.noScene}</h2><p>${text.noSceneText}</p><a class="button primary" href="#/new">${words.queue.openPlayground}</a></div></div>`;
  return html`<div class="page">${title}
    <form class="panel batch-form" onSubmit=${submit}>
      <p>${text.scene} <strong>${scene.name || words.queue.untitled}</strong> <a href=${job || edited ? `#/edit/${job || edited}` : '#/new'}>${text.edit}</a></p>
      <label>${words.queue.columns.name}<input type="text" value=${name.value} placeholder=${scene.name || ''} onInput=${(/** @type {any} */ event) => { name.value = event.target.value; }} /></label>
      <datalist id="pointers">${[...known].slice(0, POINTERS_MAX).map(([pointer, value]) => html`<option value=${pointer}>${String(value)}</option>`)}</datalist>
      ${axes.value.map(({pointer, written}, row) => html`<div class="axis" key=${row}>
        <label>${text.pointer}<input type="text" list="pointers" required placeholder="/camera/fov" value=${pointer} onInput=${(/** @type {any} */ event) => change(row, {pointer: event.target.value})} /></label>
        <label><span>${text.values} ${known.has(pointer) ? text.now(shortValue(known.get(pointer))) : ''}</span><input type="text" required placeholder="30..60:5" value=${written} onInput=${(/** @type {any} */ event) => change(row, {written: event.target.value})} /></label>
        ${axes.value.length > 1 && html`<button type="button" onClick=${() => { axes.value = axes.value.filter((_, i) => i !== row); }}>${words.queue.remove}</button>`}</div>`)}
      <p class="dim">${text.valuesHelp}</p>
      <div class="buttons"><button type="button" onClick=${() => { axes.value = [...axes.value, {pointer: '', written: ''}]; }}>${text.addAxis}</button>${turned && html`<button type="button" title=${text.turnHelp} onClick=${turn}>${text.turn}</button>`}<span class="number" role="status">${sweep ? text.total(jobs, seconds.value === null ? '' : duration(seconds.value * jobs)) : ''}</span></div>
      <${Failure} problem=${problem.value} />
      ${problem.value?.errors?.length > 0 && html`<ul class="needs">${problem.value.errors.slice(0, 10).map((/** @type {any} */ each) => html`<li><code>${each.pointer}</code> ${each.detail}</li>`)}</ul>`}
      <div class="buttons"><button class="primary" type="submit" disabled=${!sweep || busy.value}>${sweep ? text.submit(count(jobs)) : words.playground.render}</button></div>
    </form></div>`;
}
