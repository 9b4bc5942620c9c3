/** Shared by all tabs of a browser: one event stream, because browsers open only six connections to a host. */
import {Bells} from './bells.js';
import {EventStream} from './event-stream.js';

/** @typedef {import('./event-stream.js').Message} Message */

const ANSWER_MS = 300;

/** The one that was visible last is at the end. @type {Set<MessagePort>} */
const ports = new Set();
/** The last state and figures, for tabs that come later. @type {Map<string, any>} */
const latest = new Map();
/** Timers by the id of a job that was announced. @type {Map<string, any>} */
const unanswered = new Map();
let key = '';

/** @param {Message | {type: 'bells', ids: string[]}} message */
function sendAll(message) {
  if (['state', 'queue', 'health', 'bells'].includes(message.type)) latest.set(message.type, message);
  for (const port of ports) port.postMessage(message);
}

/** Notifies the tab that was visible last; if it does not answer because it is gone, the one before. @param {import('./bells.js').Ended} job */
function ring(job) {
  const port = [...ports].at(-1);
  if (!port) return bells.set([job.kind === 'batch' ? `batch/${job.id}` : job.id], true);  // until a tab comes
  port.postMessage({type: 'bell', job});
  unanswered.set(job.id, setTimeout(() => { ports.delete(port); ring(job); }, ANSWER_MS));
}

const bells = new Bells(ring, (ids) => sendAll({type: 'bells', ids}), () => stream.headers());
const stream = new EventStream((message) => {
  sendAll(message);
  if (message.type === 'event') bells.event(message.event);
  if (message.type === 'reload') bells.check();
});

addEventListener('connect', (event) => {
  const port = /** @type {MessageEvent} */ (event).ports[0];
  port.onmessage = ({data}) => {
    if (data.type === 'bells') bells.set(data.ids, data.on);
    if (data.type === 'rung') clearTimeout(unanswered.get(data.id));
    if (data.type === 'visible') {
      ports.delete(port);
      ports.add(port);
    }
    if (data.type === 'leave') {
      ports.delete(port);
      if (ports.size === 0) stream.stop();
    }
    if (data.type !== 'enter') return;
    const alone = ports.size === 0;
    ports.add(port);
    for (const message of latest.values()) port.postMessage(message);
    if (alone || data.key !== key || latest.get('state')?.state === 'locked') stream.start(key = data.key);
    if (alone) bells.set(data.ids, true);
    bells.check();
  };
});
