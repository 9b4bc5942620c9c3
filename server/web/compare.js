/** Two jobs side by side: images, differences in numbers, and what differs in their documents. */
import {useComputed, useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect} from 'preact/hooks';
import {getJson, mayWrite} from './api.js';
import {difference, load} from './compare-source.js';
import {documentDifference} from './pointers.js';
import {count, duration, figure} from './format.js';
import {addKeys, DIGITS} from './keys.js';
import {attempt, Entry, HeatLegend, Icon, Splitter, Thumbnail} from './parts.js';
import {errorText} from './queue.js';
import {route, setQuery} from './routes.js';
import {upload} from './scenes.js';
import {patchText} from './sweep.js';
import {Viewer} from './viewer.js';
import {Caller} from './workers.js';
import {words} from './words.js';

const text = words.compare;
const MODES = /** @type {const} */ (['wipe', 'side', 'blink', 'difference', 'sign']);
const SLOWEST_MS = 1000, FASTEST_MS = 334;  // at most three times a second (WCAG 2.3.1)

/** @typedef {Record<string, any>} Job */
/** @typedef {import('./compare-source.js').Side & {url: string}} Side */

export function Compare() {
  const a = route.value.query.get('a') || '', b = route.value.query.get('b') || '';
  if (!a || !b) return html`<${Chooser} other=${a || b} />`;
  return html`<${Pair} key=${a + b} a=${a} b=${b} />`;
}

/** Recent jobs with an image. @param {{other: string}} properties */
function Chooser({other}) {
  const jobs = useSignal(/** @type {Job[] | null} */ (null)), unfit = useSignal(/** @type {Job[]} */ ([]));
  useEffect(() => {
    const [id] = other.split('/'), sized = id.length === 36 ? getJson(`/v1/jobs/${id}`).catch(() => null) : Promise.resolve(null);
    Promise.all([getJson('/v1/jobs?state=succeeded&kind=render&limit=200'), sized]).then(([reply, first]) => {
      const fits = (/** @type {Job} */ job) => job.image?.width === first?.image?.width && job.image?.height === first?.image?.height;
      const others = reply.items.filter((/** @type {Job} */ job) => job.id !== other);
      jobs.value = first ? others.filter(fits) : others;
      unfit.value = first ? others.filter((/** @type {Job} */ job) => !fits(job)) : [];
    }, () => { jobs.value = []; });
  }, [other]);
  const choose = (/** @type {string} */ id) => setQuery(other ? {a: other, b: id} : {a: id});
  const file = (/** @type {any} */ event) => attempt(async () => { if (event.target.files[0]) choose((await upload(event.target.files[0])).hash); });
  return html`<div class="page"><h1>${words.titles.compare}</h1><p class="dim">${other ? text.chooseOther : text.chooseFirst}</p>
    ${mayWrite.value && html`<label class="switch">${text.file}<input type="file" accept="image/*,.exr,.hdr" onChange=${file} /></label>`}
    ${jobs.value?.length === 0 && unfit.value.length === 0 ? html`<div class="empty"><h2>${text.nothing}</h2><a class="button" href="#/">${words.toQueue}</a></div>`
      : html`<${Choices} jobs=${jobs.value || []} choose=${choose} />`}
    ${unfit.value.length > 0 && html`<h2>${text.otherSizes}</h2><${Choices} jobs=${unfit.value} choose=${choose} />`}</div>`;
}

/** @param {{jobs: Job[], choose: (id: string) => void}} properties */
function Choices({jobs, choose}) {
  return jobs.length > 0 && html`<ul class="choices">${jobs.map((job) => html`<li key=${job.id}><button onClick=${() => choose(job.id)}><${Thumbnail} job=${job} />
    <span>${job.name || words.queue.untitled} ${patchText(job.variation?.values).slice(0, 2).map((each) => html`<span class="chip">${each}</span>`)}<br /><span class="dim number">${job.image.width} × ${job.image.height}, ${errorText(job)}</span></span></button></li>`)}</ul>`;
}

/** @param {{a: string, b: string}} properties */
function Pair({a, b}) {
  const sides = useSignal(/** @type {[Side, Side] | null} */ (null)), problem = useSignal('');
  const found = useSignal(/** @type {any} */ (null)), maps = useSignal({difference: '', sign: ''});
  const query = route.value.query;
  const mode = MODES.find((each) => each === query.get('mode')) || 'wipe';
  const [z, x, y] = ['z', 'x', 'y'].map((name) => Number(query.get(name)) || 0);
  const view = useSignal({zoom: z, x, y});
  const requested = Number(query.get('tolerance') || NaN), tolerance = useSignal(Number.isNaN(requested) ? 1 : requested);
  useEffect(() => {
    const worker = new Caller('image-worker.js'), closing = new AbortController();
    /** @type {string[]} */
    const urls = [];
    const urlOf = (/** @type {Blob | null | undefined} */ blob) => blob ? urls[urls.push(URL.createObjectURL(blob)) - 1] : '';
    (async () => {
      const [first, second] = await Promise.all([load(a, worker, closing.signal), load(b, worker, closing.signal)]);
      if (closing.signal.aborted) return;
      sides.value = [{...first, url: urlOf(first.shown)}, {...second, url: urlOf(second.shown)}];
      const differs = await difference([first, second], worker);
      if (closing.signal.aborted) return;
      maps.value = {difference: urlOf(differs.heat), sign: urlOf(differs.sign)};
      found.value = differs;
    })().catch((error) => { if (!closing.signal.aborted) problem.value = error.message; });
    return () => { closing.abort(); worker.stop(); urls.forEach((url) => URL.revokeObjectURL(url)); };
  }, [a, b]);
  useEffect(() => {
    const timer = setTimeout(() => {
      const {zoom, x: left, y: top} = view.value;
      setQuery(zoom > 0 ? {z: zoom.toFixed(5), x: left.toFixed(2), y: top.toFixed(2)} : {z: null, x: null, y: null});
    }, 300);
    return () => clearTimeout(timer);
  }, [view.value]);
  useEffect(() => addKeys({[DIGITS]: (key) => { if (MODES[Number(key) - 1]) setQuery({mode: MODES[Number(key) - 1]}); }}), []);
  if (!sides.value) return html`<div class="page"><h1>${words.titles.compare}</h1>${problem.value ? html`<p class="note bad" role="alert">${problem.value}</p>` : html`<p class="dim">${words.loading}</p>`}</div>`;
  const [first, second] = sides.value, still = matchMedia('(prefers-reduced-motion: reduce)').matches;
  const name = (/** @type {Side} */ side) => side.job ? html`<a href=${`#/jobs/${side.job.id}`}>${side.name}</a> <span class="dim number">${errorText(side.job)}</span>` : side.name;
  const goTo = () => { const {x: column, y: row} = found.value.worst; view.value = {zoom: 16, x: 300 - column * 16, y: 200 - row * 16}; };
  const size = found.value || first.job?.image || second.job?.image || null, viewer = {size, view};
  const isOff = (/** @type {string} */ each) => (each === 'blink' && still) || (each === 'sign' && !!found.value && !maps.value.sign);
  return html`<div class="job compare">
    <header class="bar"><h1>${words.titles.compare}</h1><span class="pair">A: ${name(first)}</span><span class="pair">B: ${name(second)}</span><span class="spring"></span>
      <div class="buttons" role="group" aria-label=${text.mode}>${MODES.map((each) => html`<button aria-pressed=${mode === each} disabled=${isOff(each)} onClick=${() => setQuery({mode: each})}>${text.modes[each]}</button>`)}</div></header>
    ${mode === 'blink' && !still ? html`<${Blink} first=${first} second=${second} viewer=${viewer} />`
      : mode === 'side' ? html`<div class="sides"><${Viewer} ...${viewer} url=${first.url} alt="A">${text.notShown}</${Viewer}><${Viewer} ...${viewer} url=${second.url} alt="B">${text.notShown}</${Viewer}></div>`
      : mode === 'difference' || mode === 'sign' ? html`<${Viewer} ...${viewer} url=${maps.value[mode]} alt=${text.modes[mode]}>${problem.value || words.loading}</${Viewer}>`
      : html`<${Viewer} ...${viewer} url=${first.url || second.url} alt=${first.url ? 'A' : 'B'} cover=${first.url && second.url} coverAlt="B" sides="A | B">${text.notShown}</${Viewer}>`}
    <${Splitter} name="tabs" label=${words.panes.tabs} />
    <div class="tabs"><div class="tab">
      ${problem.value && html`<p class="note bad" role="alert">${problem.value}</p>`}
      ${mode === 'difference' && found.value?.white && html`<${HeatLegend} white=${found.value.white} unit=${words.queue.levels} />`}
      ${mode === 'sign' && maps.value.sign && html`<p class="legend-sign dim"><span class="key darker"></span>${text.darker} <span class="key brighter"></span>${text.brighter}</p>`}
      ${found.value && html`<${Numbers} found=${found.value} tolerance=${tolerance} goTo=${goTo} />`}
      ${first.job && second.job && html`<${Documents} first=${first} second=${second} />`}
    </div></div>
  </div>`;
}

/** @param {{first: Side, second: Side, viewer: any}} properties */
function Blink({first, second, viewer}) {
  const showsFirst = useSignal(true), plays = useSignal(true), interval = useSignal(500);
  useEffect(() => {
    if (!plays.value) return;
    const timer = setInterval(() => { showsFirst.value = !showsFirst.value; }, interval.value);
    return () => clearInterval(timer);
  }, [plays.value, interval.value]);
  useEffect(() => addKeys({' ': () => { plays.value = !plays.value; }}), []);
  const side = showsFirst.value ? first : second;
  return html`<div class="blink"><${Viewer} ...${viewer} url=${side.url} alt=${showsFirst.value ? 'A' : 'B'}>${text.notShown}</${Viewer}>
    <div class="buttons"><strong>${showsFirst.value ? 'A' : 'B'}</strong><button onClick=${() => { plays.value = !plays.value; }}>${plays.value ? text.pause : text.play}</button>
      <label class="switch">${text.speed}<input type="range" min=${FASTEST_MS} max=${SLOWEST_MS} value=${interval.value} onInput=${(/** @type {any} */ event) => { interval.value = Number(event.target.value); }} /></label></div></div>`;
}

/** @param {{found: any, tolerance: import('@preact/signals').Signal<number>, goTo: () => void}} properties */
function Numbers({found, tolerance, goTo}) {
  const passes = useComputed(() => found.rmse <= tolerance.value).value;
  const set = (/** @type {any} */ event) => {
    if (event.target.value === '') return;  // nothing, or the beginning of a number
    tolerance.value = Number(event.target.value);
    setQuery({tolerance: event.target.value});
  };
  const most = Math.max(...found.histogram || []);
  const label = (/** @type {number} */ i) => i < 2 ? String(i) : i === 2 ? '2–3' : `${2 ** (i - 1)}–${2 ** i - 1}`;
  return html`<section><h2>${text.numbers}</h2>
    <dl class="facts-list"><dt>RMS</dt><dd class="number" data-value=${found.rmse}>${found.rmse.toFixed(3)} ${words.queue.levels}</dd>
      <dt>${text.bias}</dt><dd class="number" data-value=${found.bias}>${found.bias.toFixed(3)} ${words.queue.levels}</dd>
      <dt>PSNR</dt><dd class="number" data-value=${found.psnr}>${Number.isFinite(found.psnr) ? found.psnr.toFixed(2) + ' dB' : text.equal}</dd>
      <dt>${text.beyond}</dt><dd class="number">${(100 * found.share).toFixed(2)} %</dd>
      <dt>${text.worst}</dt><dd class="number"><button class="link" onClick=${goTo}>x ${found.worst.x}, y ${found.worst.y}: ${figure(found.worst.levels)} ${words.queue.levels}</button></dd></dl>
    <div class="buttons"><label class="switch">${text.tolerance}<${Entry} class="tolerance" type="number" min="0" step="any" value=${tolerance.value} onInput=${set} />${text.toleranceUnit}</label>
      <span class="state verdict" data-state=${passes ? 'succeeded' : 'failed'}><${Icon} name=${passes ? 'succeeded' : 'failed'} /><strong>${passes ? text.pass : text.fail}</strong></span></div>
    ${found.formats && html`<p class="dim">${text.byService(found.formats)}</p>`}
    ${found.histogram && html`<table class="plain"><caption class="dim">${text.histogram}</caption><tbody>${found.histogram.map((/** @type {number} */ pixels, /** @type {number} */ i) => html`<tr><td class="number">${label(i)}</td><td class="histogram"><span style=${{width: `${100 * pixels / most}%`}}></span></td><td class="right number">${count(pixels)}</td></tr>`)}</tbody></table>`}
  </section>`;
}

/** @param {{first: Side, second: Side}} properties */
function Documents({first, second}) {
  const rows = documentDifference({...first.scene, job: undefined}, {...second.scene, job: undefined});
  const rays = (/** @type {Side} */ {job}) => Object.values(job?.report?.rays || {}).reduce((sum, each) => sum + Number(each), 0);
  const seconds = (/** @type {Side} */ {job}) => (job?.report?.time_ms.trace || 0) / 1000;
  return html`<section><h2>${text.differs}</h2><table class="plain differs"><thead><tr><th></th><th>A</th><th>B</th></tr></thead><tbody>
    ${rows.slice(0, 100).map(({pointer, a, b}) => html`<tr><td><code>${pointer}</code></td><td class="number">${a.slice(0, 60)}</td><td class="number">${b.slice(0, 60)}</td></tr>`)}
    ${rows.length === 0 && html`<tr><td colspan="3" class="dim">${text.sameDocument}</td></tr>`}
    <tr><td>${words.job.time}</td><td class="number">${duration(seconds(first))}</td><td class="number">${duration(seconds(second))}</td></tr>
    <tr><td>${words.job.rays}</td><td class="number">${count(rays(first))}</td><td class="number">${count(rays(second))}</td></tr>
    <tr><td>${words.queue.columns.error}</td><td class="number">${figure(first.job?.report?.error.estimate)}</td><td class="number">${figure(second.job?.report?.error.estimate)}</td></tr></tbody></table></section>`;
}
