/** One job, kept current, and its document. */
import {useSignal} from '@preact/signals';
import {findNodeAtLocation, parseTree} from 'jsonc-parser';
import {useEffect} from 'preact/hooks';
import {Problem, request} from './api.js';
import {listen} from './store.js';

const POLL_MS = 5000, POINTS_MS = 1000, STORED_TEXT = 'whittle.text';

/** @typedef {Record<string, any>} Job */

/** @param {Job} job */
const isOver = (job) => ['succeeded', 'failed', 'cancelled'].includes(job.state);

/** The job with its ETag, kept current. @param {string} id */
export function useJob(id) {
  const job = useSignal(/** @type {Job | null} */ (null)), etag = useSignal(''), problem = useSignal(/** @type {Problem | null} */ (null));
  useEffect(() => {
    let timer = 0, closed = false;
    const read = async () => {
      timer = 0;
      try {
        const reply = await request('GET', `/v1/jobs/${id}`);
        const body = await reply.json();
        if (closed) return;
        etag.value = reply.headers.get('ETag') || '';
        job.value = body;
        problem.value = null;
      } catch (error) {
        if (closed || !(error instanceof Problem)) return;
        problem.value = error;
        if (error.status === 404) job.value = null;  // it was removed
      }
    };
    const soon = (/** @type {number} */ wait) => { timer ||= window.setTimeout(read, wait); };
    const stop = listen({
      event: (event) => {
        if (event.id !== id) return;
        if (event.type === 'progress' && job.value) {
          job.value = {...job.value, state: event.state, progress: event.progress};
          if (event.kind === 'measure') soon(POINTS_MS);  // each point is a step of its progress
        } else soon(50);
      },
      reload: () => soon(0),
    });
    const poll = setInterval(() => { if (job.value && !isOver(job.value)) soon(0); }, POLL_MS);
    read();
    return () => { closed = true; stop(); clearTimeout(timer); clearInterval(poll); };
  }, [id]);
  return {job, etag, problem};
}

/** Key of the text that the playground keeps: one for each job whose document is edited, and one without a job. @param {string} job */
const storedAs = (job) => job ? `${STORED_TEXT}.${job}` : STORED_TEXT;

/** Keeps a text of the playground: in this tab, and the one of no job also for later. @param {string} job @param {string} text */
export function storeText(job, text) {
  for (const storage of job ? [sessionStorage] : [sessionStorage, localStorage]) {
    try {
      storage.setItem(storedAs(job), text);
    } catch {
      storage.removeItem(storedAs(job));  // larger than the browser keeps
    }
  }
}

/** The text of the playground, or null: that of this tab, before that of another one. @param {string} job */
export const storedText = (job) => sessionStorage.getItem(storedAs(job)) ?? (job ? null : localStorage.getItem(STORED_TEXT));

/** The scene document of a job as it was written; of a measurement, the scene in its request. @param {string} id @returns {Promise<string>} */
export async function documentOf(id) {
  const text = await (await request('GET', `/v1/jobs/${id}/scene`)).text();
  if (!/^\s*\{\s*"(scene|settings)"/.test(text)) return text;
  const root = parseTree(text), scene = root && findNodeAtLocation(root, ['scene']);
  return scene ? text.slice(scene.offset, scene.offset + scene.length) : text;
}
