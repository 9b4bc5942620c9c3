/** The service itself: whether jobs run and why not, the last hour, workers, limits against use, versions. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import uPlot from 'uplot';
import {getJson, me} from './api.js';
import {count, duration, size} from './format.js';
import {Failure} from './parts.js';
import {words} from './words.js';

const READ_MS = 5000, PLOT_HEIGHT = 150, STEPS_OF_A_MINUTE = 12;
const text = words.system;

/** @typedef {Record<string, any>} Status */
/** @typedef {{name: string, values: (number | null)[], color: string}} Line */

/** Four plots of the last hour. @param {Status['history']} history @returns {{title: string, lines: Line[]}[]} */
export function plotsOf(history) {
  /** Sums of the minute that ends with each step. */
  const perMinute = (/** @type {number[]} */ values) => values.map((_, i) => values.slice(Math.max(0, i - STEPS_OF_A_MINUTE + 1), i + 1).reduce((sum, each) => sum + each, 0));
  const seconds = (/** @type {(number | null)[]} */ values) => values.map((ms) => ms === null ? null : ms / 1000);
  return [
    {title: text.depth, lines: [{name: words.states.queued, values: history.queued, color: '--wait'}, {name: words.states.running, values: history.running, color: '--run'}]},
    {title: text.wait, lines: [{name: text.median, values: seconds(history.wait_p50_ms), color: '--run'}, {name: text.p95, values: seconds(history.wait_p95_ms), color: '--brand'}]},
    {title: text.ended, lines: [{name: text.perMinute, values: perMinute(history.ended), color: '--ok'}]},
    {title: text.failed, lines: [{name: text.perMinute, values: perMinute(history.failed), color: '--bad'}]},
  ];
}

export function System() {
  const status = useSignal(/** @type {Status | null} */ (null)), problem = useSignal(/** @type {any} */ (null));
  const nodes = useSignal(/** @type {any[]} */ ([]));
  useEffect(() => {
    const read = () => {
      if (document.visibilityState !== 'visible') return;
      getJson('/v1/status').then((body) => { status.value = body; problem.value = null; }, (error) => { problem.value = error; });
      getJson('/v1/nodes').then((body) => { nodes.value = body.items; }, () => {});  // the status shows the problem
    };
    read();
    const timer = setInterval(read, READ_MS);
    return () => clearInterval(timer);
  }, []);
  const value = status.value;
  if (!value) return html`<div class="page"><h1>${words.titles.system}</h1><${Failure} problem=${problem.value} /></div>`;
  const word = value.draining ? text.draining : value.ready ? text.ready : text.notReady;
  return html`<div class="page system">
    <h1>${words.titles.system}</h1>
    <${Failure} problem=${problem.value} />
    <section class=${`panel health ${value.ready ? '' : 'bad'}`} role="status"><strong>${word}</strong>
      <p>${value.ready ? text.jobsRun : value.reason}</p>
      <p class="dim">${text.disk(size(value.disk.free_bytes), size(value.disk.reserve_bytes))}</p></section>
    <div class="plots">${plotsOf(value.history).map((plot) => html`<${Plot} ...${plot} history=${value.history} />`)}</div>
    <div class="columns">
      <section class="panel"><h2>${text.nodes}</h2><table class="plain"><thead><tr><th>${text.machine}</th><th>${text.role}</th><th>${text.jobs}</th><th>${text.versions}</th><th>${text.seen}</th></tr></thead><tbody>
        ${nodes.value.map((each) => html`<tr><td title=${each.id}>${each.name}</td><td>${each.role}</td><td class="number">${each.running} / ${each.slots}</td><td class="number">${each.version}</td><td class="number">${text.ago(duration(secondsSince(each.seen_at, nodes.value)))}</td></tr>`)}</tbody></table></section>
      <section class="panel"><h2>${text.workers}</h2><table class="plain"><thead><tr><th>${text.process}</th><th>${text.jobs}</th><th>${text.memory}</th><th>${text.sandbox}</th></tr></thead><tbody>
        ${value.workers.map((/** @type {any} */ each) => html`<tr><td class="number">${each.pid}</td><td class="number">${each.jobs} / ${each.places}</td><td class="number">${size(each.rss_bytes)}</td><td>${each.sandbox || text.none}</td></tr>`)}</tbody></table></section>
      <section class="panel"><h2>${text.use}</h2><table class="plain"><tbody>
        ${uses(value).map(({name, used, limit, format}) => html`<tr><td>${name}</td><td class="right number">${format(used)}</td><td class="right number dim">${text.of(format(limit))}</td>
          <td><meter min="0" max=${limit} value=${used} aria-label=${name}></meter></td></tr>`)}</tbody></table></section>
      <section class="panel"><h2>${text.versions}</h2><dl class="facts-list"><dt>${words.product}</dt><dd class="number">${value.version.build}</dd>
        <dt>${text.memory}</dt><dd class="number">${size(value.memory.rss_bytes)}</dd>
        <dt>${text.caches}</dt><dd class="number">${text.cached(size(value.caches.geometry_bytes), size(value.caches.image_bytes))}</dd>
        <dt>${words.pages.docs}</dt><dd><a href="/docs">/docs</a>, <a href="/openapi.json">/openapi.json</a></dd>
        <dt>${text.licences}</dt><dd><a href=${new URL('./licences.txt', import.meta.url).pathname}>licences.txt</a></dd></dl></section>
      <details class="panel"><summary>${text.limits}</summary><dl class="facts-list">${Object.entries(value.limits).map(([name, limit]) => html`<dt><code>${name}</code></dt><dd class="number">${name.endsWith('_bytes') ? size(Number(limit)) : name.endsWith('_s') ? duration(Number(limit)) : count(Number(limit))}</dd>`)}</dl></details>
    </div>
  </div>`;
}

/** Compared with the node that was seen last, as the clock of the browser may differ. @param {string} time @param {any[]} nodes */
function secondsSince(time, nodes) {
  return (Math.max(...nodes.map((node) => Date.parse(node.seen_at))) - Date.parse(time)) / 1000;
}

/** @param {Status} status */
function uses({used, limits, streams}) {
  const key = me.value;
  return [
    {name: text.queuedJobs, used: used.queued_jobs, limit: limits.queued_jobs, format: count},
    {name: text.images, used: used.artifact_bytes, limit: limits.artifact_bytes, format: size},
    {name: text.uploads, used: used.uploads_bytes, limit: limits.uploads_bytes, format: size},
    {name: text.streams, used: streams.open, limit: streams.limit, format: count},
    ...(key?.name ? [{name: text.yourJobs, used: key.used.queued_jobs, limit: key.quotas.queued_jobs, format: count},
                     {name: text.yourImages, used: key.used.artifact_bytes, limit: key.quotas.artifact_bytes, format: size}] : []),
  ];
}

/** @param {number} seconds since 1970 */
const clock = (seconds) => new Date(1000 * seconds).toLocaleTimeString([], {hour: '2-digit', minute: '2-digit', hour12: false});

/** @param {{title: string, lines: Line[], history: Status['history']}} properties */
function Plot({title, lines, history}) {
  const box = useRef(/** @type {HTMLElement | null} */ (null)), plot = useRef(/** @type {uPlot | null} */ (null));
  const end = Date.parse(history.until) / 1000, steps = history.queued.length;
  const data = /** @type {uPlot.AlignedData} */ ([Array.from({length: steps}, (_, i) => end - (steps - 1 - i) * history.step_s), ...lines.map((line) => line.values)]);
  useEffect(() => {
    const element = /** @type {HTMLElement} */ (box.current);
    const color = (/** @type {string} */ name) => getComputedStyle(document.documentElement).getPropertyValue(name);
    const axis = {stroke: () => color('--dim'), grid: {stroke: () => color('--line'), width: 1}, ticks: {show: false}, font: '11px system-ui, sans-serif'};
    const made = plot.current = new uPlot({
      width: element.clientWidth, height: PLOT_HEIGHT, legend: {show: false}, cursor: {drag: {x: false, y: false}},
      scales: {y: {range: (_, __, most) => [0, Math.max(1, most * 1.1)]}},
      axes: [{...axis, space: 90, size: 30, values: (_, seconds) => seconds.map(clock)}, {...axis, size: 44, space: 36}],
      series: [{}, ...lines.map((line) => ({label: line.name, stroke: () => color(line.color), width: 1.5, spanGaps: true, points: {show: steps < 30}}))],
    }, data, element);
    const themes = new MutationObserver(() => made.redraw());
    themes.observe(document.documentElement, {attributeFilter: ['data-theme']});
    const observer = new ResizeObserver(() => made.setSize({width: element.clientWidth, height: PLOT_HEIGHT}));
    observer.observe(element);
    return () => { themes.disconnect(); observer.disconnect(); made.destroy(); };
  }, []);
  useEffect(() => { plot.current?.setData(data); }, [history]);
  const last = (/** @type {Line} */ line) => line.values.findLast((value) => value !== null);
  return html`<section class="panel plot"><h2>${title}</h2><div ref=${box} aria-hidden="true"></div>
    <ul>${lines.map((line) => html`<li><span class="key" style=${{background: `var(${line.color})`}}></span>${line.name} <span class="number">${Number((last(line) ?? 0).toPrecision(3))}</span></li>`)}</ul></section>`;
}
