/** State of the service while the page is open: connection, figures of the queue, events of jobs. */
import {effect, signal, untracked} from '@preact/signals';
import {identify, key, locked} from './api.js';
import {Bells} from './bells.js';
import {EventStream} from './event-stream.js';
import {workerUrl} from './workers.js';

/** @typedef {import('./event-stream.js').Message} Message */
/** @typedef {import('./event-stream.js').JobEvent} JobEvent */

/** @type {import('@preact/signals').Signal<import('./event-stream.js').State>} */
export const connection = signal('connecting');
/** GET /v1/queue. @type {import('@preact/signals').Signal<any>} */
export const figures = signal(null);
/** @type {import('@preact/signals').Signal<import('./service-state.js').Health | null>} */
export const health = signal(null);

const STORED_BELLS = 'whittle.bells';
/** Ids of the jobs, and "batch/" with those of the batches, whose end is announced. */
export const bells = signal(/** @type {string[]} */ (JSON.parse(localStorage.getItem(STORED_BELLS) || '[]')));
/** The last one that ended; this tab announces it. @type {import('@preact/signals').Signal<import('./bells.js').Ended | null>} */
export const rung = signal(null);
/** Requests that the end of jobs is announced, or no longer. @type {(ids: string[], on: boolean) => void} */
export let setBells = () => undefined;

/** @type {Set<{event: (event: JobEvent) => void, reload: () => void}>} */
const listeners = new Set();

/** @param {{event: (event: JobEvent) => void, reload: () => void}} listener @returns {() => void} removes it */
export function listen(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** @param {string[]} ids */
function keepBells(ids) {
  bells.value = ids;
  localStorage.setItem(STORED_BELLS, JSON.stringify(ids));
}

/** @param {Message | {type: 'bells', ids: string[]} | {type: 'bell', job: import('./bells.js').Ended}} message */
function receive(message) {
  if (message.type === 'state') {
    connection.value = message.state;
    if (message.state === 'locked') identify().catch(() => undefined);  // opens the dialog for the key
  }
  else if (message.type === 'queue') figures.value = message.queue;
  else if (message.type === 'health') health.value = message.health;
  else if (message.type === 'bells') keepBells(message.ids);
  else if (message.type === 'bell') rung.value = message.job;
  else if (message.type === 'event') for (const listener of listeners) listener.event(message.event);
  else for (const listener of listeners) listener.reload();
}

function shareStream() {
  const worker = new SharedWorker(workerUrl('stream-worker.js'), {type: 'module', name: 'whittle-events'});
  worker.port.onmessage = ({data}) => {
    receive(data);
    if (data.type === 'bell') worker.port.postMessage({type: 'rung', id: data.job.id});
  };
  worker.port.start();
  setBells = (ids, on) => worker.port.postMessage({type: 'bells', ids, on});
  const notifyVisible = () => { if (document.visibilityState === 'visible') worker.port.postMessage({type: 'visible'}); };
  document.addEventListener('visibilitychange', notifyVisible);
  return {
    enter: () => worker.port.postMessage({type: 'enter', key: key.value, ids: bells.value}),
    leave: () => worker.port.postMessage({type: 'leave'}),
  };
}

/** Without a shared worker a tab has its own stream, while it is visible. */
function ownStream() {
  const own = new Bells((job) => { rung.value = job; }, keepBells, () => stream.headers());
  const stream = new EventStream((message) => {
    receive(message);
    if (message.type === 'event') own.event(message.event);
  });
  setBells = (ids, on) => own.set(ids, on);
  const follow = () => {
    if (document.visibilityState !== 'visible') return stream.stop();
    stream.start(key.value);
    own.set(bells.value, true);
    own.check();
  };
  document.addEventListener('visibilitychange', follow);
  return {enter: follow, leave: () => stream.stop()};
}

export function startStream() {
  const stream = typeof SharedWorker === 'function' ? shareStream() : ownStream();
  effect(() => {
    if (locked.value === null) untracked(() => stream.enter());  // it changes the bells
  });
  window.addEventListener('pagehide', () => stream.leave());
  window.addEventListener('pageshow', (event) => { if (event.persisted) stream.enter(); });
}
