/** The plot of a measurement: true error against seconds, both logarithmic, with the claimed error and the Pareto front. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {figure} from './format.js';
import {words} from './words.js';

const text = words.measure;
const LEFT = 52, RIGHT = 20, TOP = 18, BOTTOM = 40, TARGET = 13;

/** @typedef {{parameter: string, value: string, preset: string | null, settings: Record<string, any>, seconds: number, error: number, upper_limits?: string[], broken: boolean, claimed: number, model: string | null, model_error: number | null, total_error: number | null}} Point */

/** Outlines about the origin and colours, so that neither alone identifies the parameter. @type {Record<string, {mark: string, color: string}>} */
const MARKS = {
  target_error: {mark: 'M5 0A5 5 0 1 1 -5 0A5 5 0 1 1 5 0', color: '--run'},
  samples: {mark: 'M-4.500 -4.500H4.500V4.500H-4.500Z', color: '--brand'},
  max_depth: {mark: 'M0 -5.500L5.500 4.500H-5.500Z', color: '--ok'},
  cutoff: {mark: 'M0 -6L6 0L0 6L-6 0Z', color: '--off'},
  approximate: {mark: 'M-5 -3L-3 -5L0 -2L3 -5L5 -3L2 0L5 3L3 5L0 2L-3 5L-5 3L-2 0Z', color: '--bad'},
  model: {mark: 'M0 -6L1.400 -1.900H5.700L2.200 0.700L3.500 4.900L0 2.300L-3.500 4.900L-2.200 0.700L-5.700 -1.900H-1.400Z', color: '--run'},
  document: {mark: 'M-1.500 -6H1.500V-1.500H6V1.500H1.500V6H-1.500V1.500H-6V-1.500H-1.500Z', color: '--text'},
};

/** Milliseconds below a second. @param {number} seconds */
export const time = (seconds) => seconds < 1 ? `${figure(seconds * 1000)} ms` : `${figure(seconds)} s`;

/** "target_error 1 (standard)" @param {Point} point */
export function nameOf({parameter, value, preset}) {
  const name = parameter === 'document' ? text.document : parameter === 'approximate' || parameter === 'model' ? value : `${parameter} ${value}`;
  return preset ? `${name} (${preset})` : name;
}

/** One of the errors of a point, "≤ 0.5" for an upper limit; the model of paths is the rendering equation. @param {Point} point @param {'error' | 'model_error' | 'total_error'} name */
export const errorText = (point, name) => name === 'model_error' && point.model === 'path' ? '0' : point[name] === null ? '' : `${point.upper_limits?.includes(name) ? '≤ ' : ''}${figure(/** @type {number} */ (point[name]))}`;

/** The error of a point in the plot: that to the rendering equation if models are compared. @param {Point} point */
const errorOf = ({error, total_error}) => total_error ?? error;

/** A logarithmic axis. A value of 0 is drawn at its lower end. @param {number[]} values @param {number} from pixel of the lower end @param {number} to @param {number} apart least pixels between labels */
function axisOf(values, from, to, apart) {
  const positive = values.filter((value) => value > 0);
  const low = Math.log10(Math.min(...positive) / 1.6), high = Math.log10(Math.max(...positive) * 1.6);
  const decadePixels = Math.abs(to - from) / (high - low);
  const steps = decadePixels * Math.log10(2) >= apart ? [1, 2, 5] : decadePixels * Math.log10(3) >= apart ? [1, 3] : [1];
  /** @type {number[]} */
  const ticks = [];
  for (let decade = Math.floor(low); decade <= high; ++decade) {
    for (const step of steps) {
      const at = decade + Math.log10(step);
      if (at >= low && at <= high) ticks.push(step * 10 ** decade);
    }
  }
  return {ticks, at: (/** @type {number} */ value) => value > 0 ? from + (Math.log10(value) - low) / (high - low) * (to - from) : from};
}

/** @param {{measurement: any, selected: number, select: (index: number) => void}} properties */
export function Plot({measurement, selected, select}) {
  const box = useRef(/** @type {HTMLElement | null} */ (null));
  const width = useSignal(0);
  useEffect(() => {
    const observer = new ResizeObserver(() => { width.value = box.current?.clientWidth || 0; });
    if (box.current) observer.observe(box.current);
    return () => observer.disconnect();
  }, []);
  return html`<div class="tradeoff" ref=${box}>${width.value > 0 && html`<${Drawing} ...${{measurement, selected, select}} width=${width.value} />`}</div>
    <${Legend} points=${measurement.points} />`;
}

/** @param {{measurement: any, selected: number, select: (index: number) => void, width: number}} properties */
function Drawing({measurement, selected, select, width}) {
  /** @type {Point[]} */
  const points = measurement.points;
  const height = Math.round(Math.max(280, Math.min(460, width * 0.6)));
  const right = width - RIGHT, bottom = height - BOTTOM;
  const x = axisOf(points.map((each) => each.seconds), LEFT, right, 46);
  const y = axisOf(points.flatMap((each) => [errorOf(each), each.claimed]), bottom, TOP, 22);
  const front = measurement.pareto_front.map((/** @type {number} */ index) => points[index]);
  const order = points.map((_, index) => index).sort((a, b) => Number(a === selected) - Number(b === selected));
  const noise = Math.max(measurement.reference.error, measurement.model_error?.standard_error || 0);
  return html`<svg width=${width} height=${height} role="img" aria-label=${text.plot(points.length)}>
    ${x.ticks.map((tick) => html`<line class="grid" x1=${x.at(tick)} x2=${x.at(tick)} y1=${TOP} y2=${bottom} /><text x=${x.at(tick)} y=${bottom + 16} text-anchor="middle">${time(tick)}</text>`)}
    ${y.ticks.map((tick) => html`<line class="grid" x1=${LEFT} x2=${right} y1=${y.at(tick)} y2=${y.at(tick)} /><text x=${LEFT - 8} y=${y.at(tick) + 4} text-anchor="end">${figure(tick)}</text>`)}
    <text class="title" x=${right} y=${height - 6} text-anchor="end">${text.seconds}</text><text class="title" x="4" y="11">${text.errorAxis}</text>
    ${noise > 0 && y.at(noise) > TOP && y.at(noise) < bottom && html`<line class="noise" x1=${LEFT} x2=${right} y1=${y.at(noise)} y2=${y.at(noise)}><title>${text.noise(figure(noise))}</title></line>`}
    <polyline class="front" points=${front.map((/** @type {Point} */ each) => `${x.at(each.seconds)},${y.at(each.claimed)}`).join(' ')} />
    ${order.map((index) => {
      const point = points[index], {mark, color} = MARKS[point.parameter] || MARKS.document, left = x.at(point.seconds), top = y.at(errorOf(point)), claimed = y.at(point.claimed);
      return html`<g key=${index} data-point=${index} data-selected=${index === selected} style=${{color: `var(${color})`}} onClick=${() => select(index)}>
        <title>${`${nameOf(point)}: ${time(point.seconds)}, ${point.total_error === null ? text.levels(errorText(point, 'error')) : text.totalIs(errorText(point, 'total_error'))}, ${text.claims(figure(point.claimed))}`}</title>
        <path class="whisker" d=${`M${left} ${top}V${claimed}M${left - 4} ${claimed}H${left + 4}`} />
        ${index === selected && html`<circle class="ring" cx=${left} cy=${top} r="10" />`}
        <path class="mark" d=${mark} transform=${`translate(${left} ${top})`} />
        <circle class="target" cx=${left} cy=${top} r=${TARGET} />
        ${point.preset && html`<text class="preset" x=${left > right - 70 ? left - 10 : left + 10} y=${top > bottom - 20 ? top - 12 : top + 15} text-anchor=${left > right - 70 ? 'end' : 'start'}>${point.preset}</text>`}
      </g>`;
    })}
  </svg>`;
}

/** @param {{points: Point[]}} properties */
function Legend({points}) {
  const used = Object.keys(MARKS).filter((name) => points.some((point) => point.parameter === name));
  return html`<ul class="marks">${used.map((name) => html`<li><svg width="14" height="14" viewBox="-7 -7 14 14" aria-hidden="true" style=${{color: `var(${MARKS[name].color})`}}><path class="mark" d=${MARKS[name].mark} /></svg>${name === 'document' ? text.document : name}</li>`)}
    <li><svg width="22" height="14" aria-hidden="true"><path class="front" d="M0 7H22" /></svg>${text.front}</li><li><svg width="10" height="14" aria-hidden="true"><path class="whisker" d="M5 13V2M1 2H9" /></svg>${text.whisker}</li></ul>`;
}
