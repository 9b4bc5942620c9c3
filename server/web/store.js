/** What the service tells of itself while the page is open: connection, figures of the queue, events of jobs. */
import {effect, signal} from '@preact/signals';
import {identify, key, locked} from './api.js';
import {EventStream} from './event-stream.js';
import {workerUrl} from './workers.js';

/** @typedef {import('./event-stream.js').Message} Message */
/** @typedef {import('./event-stream.js').JobEvent} JobEvent */

/** @type {import('@preact/signals').Signal<import('./event-stream.js').State>} */
export const connection = signal('connecting');
/** GET /v1/queue. @type {import('@preact/signals').Signal<any>} */
export const figures = signal(null);

/** @type {Set<{event: (event: JobEvent) => void, reload: () => void}>} */
const listeners = new Set();

/** @param {{event: (event: JobEvent) => void, reload: () => void}} listener @returns {() => void} removes it */
export function listen(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** @param {Message} message */
function receive(message) {
  if (message.type === 'state') {
    connection.value = message.state;
    if (message.state === 'locked') identify().catch(() => undefined);  // opens the dialog for the key
  }
  else if (message.type === 'queue') figures.value = message.queue;
  else if (message.type === 'event') for (const listener of listeners) listener.event(message.event);
  else for (const listener of listeners) listener.reload();
}

function shareStream() {
  const worker = new SharedWorker(workerUrl('stream-worker.js'), {type: 'module', name: 'whittle-events'});
  worker.port.onmessage = ({data}) => receive(data);
  worker.port.start();
  return {
    enter: () => worker.port.postMessage({type: 'enter', key: key.value}),
    leave: () => worker.port.postMessage({type: 'leave'}),
  };
}

/** Without a shared worker a tab has its own stream, while it is visible. */
function ownStream() {
  const stream = new EventStream(receive);
  const follow = () => document.visibilityState === 'visible' ? stream.start(key.value) : stream.stop();
  document.addEventListener('visibilitychange', follow);
  return {enter: follow, leave: () => stream.stop()};
}

export function startStream() {
  const stream = typeof SharedWorker === 'function' ? shareStream() : ownStream();
  effect(() => {
    if (locked.value === null) stream.enter();
  });
  window.addEventListener('pagehide', () => stream.leave());
  window.addEventListener('pageshow', (event) => { if (event.persisted) stream.enter(); });
}
