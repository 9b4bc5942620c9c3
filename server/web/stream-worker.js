/** Shared by all tabs of a browser: one event stream, because browsers open only six connections to a host. */
import {EventStream} from './event-stream.js';

/** @typedef {import('./event-stream.js').Message} Message */

/** @type {Set<MessagePort>} */
const ports = new Set();
/** The last state and figures, for tabs that come later. @type {Map<string, any>} */
const latest = new Map();
let key = '';

const stream = new EventStream((message) => {
  if (message.type === 'state' || message.type === 'queue') latest.set(message.type, message);
  for (const port of ports) port.postMessage(message);
});

addEventListener('connect', (event) => {
  const port = /** @type {MessageEvent} */ (event).ports[0];
  port.onmessage = ({data}) => {
    if (data.type === 'leave') {
      ports.delete(port);
      if (ports.size === 0) stream.stop();
      return;
    }
    const alone = ports.size === 0;
    ports.add(port);
    for (const message of latest.values()) port.postMessage(message);
    if (alone || data.key !== key || latest.get('state')?.state === 'locked') stream.start(key = data.key);
  };
});
