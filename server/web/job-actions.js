/** Actions on a job: cancel, retry, remove, measure, its priority. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect} from 'preact/hooks';
import {mayWrite, postJson, Problem, request} from './api.js';
import {documentOf} from './job-source.js';
import {addKeys} from './keys.js';
import {LiveButton} from './live/session.js';
import {announce, attempt, Bell, Dialog, Entry} from './parts.js';
import {go, route, routeOf, setQuery} from './routes.js';
import {words} from './words.js';

const text = words.job;

/** @param {{job: import('@preact/signals').Signal<any>, etag: import('@preact/signals').Signal<string>}} properties */
export function Actions({job, etag}) {
  const proposed = useSignal(/** @type {'' | 'cancel' | 'remove'} */ (''));
  const {id, state, priority} = job.value;
  const isOpen = state === 'queued' || state === 'running';
  const mayRetry = state === 'failed' || state === 'cancelled';
  const cancel = () => attempt(async () => { proposed.value = ''; job.value = await postJson(`/v1/jobs/${id}/cancel`, undefined); });
  const retry = () => attempt(async () => { job.value = await postJson(`/v1/jobs/${id}/retry`, undefined); });
  const remove = () => attempt(async () => {
    proposed.value = '';
    await request('DELETE', `/v1/jobs/${id}`).catch((error) => { if (!(error instanceof Problem) || error.status !== 404) throw error; });
    go('#/');
  });
  const measure = () => attempt(async () => go(routeOf(await postJson('/v1/measure', `{"scene": ${await documentOf(id)}}`))));
  const setPriority = (/** @type {string} */ wanted) => attempt(async () => {
    try {
      const reply = await request('PATCH', `/v1/jobs/${id}`, {json: {priority: Number(wanted)}, headers: {'If-Match': etag.value}});
      job.value = await reply.json();
      etag.value = reply.headers.get('ETag') || '';
    } catch (error) {
      if (!(error instanceof Problem) || error.status !== 412) throw error;
      const reply = await request('GET', `/v1/jobs/${id}`), now = await reply.json();
      etag.value = reply.headers.get('ETag') || '';
      job.value = now;
      announce(text.raced(now.priority, wanted));
    }
  });
  useEffect(() => { proposed.value = ''; }, [isOpen]);  // the question is about what was
  useEffect(() => addKeys({'c': () => { if (isOpen) proposed.value = 'cancel'; }, 'r': () => { if (mayRetry) retry(); }}), [id, state]);
  const hasImage = job.value.artifacts.some((/** @type {any} */ each) => each.name.startsWith('image.')) && !job.value.expired;
  const tradeOff = job.value.kind === 'measure' && route.value.page === 'jobs';
  const edit = html`${tradeOff && html`<a class="button" href=${`#/measure/${id}`}>${text.tradeOff}</a>`}<a class="button" href=${`#/edit/${id}`}>${text.edit}</a>${hasImage && html`<a class="button" href=${`#/compare?a=${id}`}>${text.compare}</a>`}`;
  const bell = isOpen && html`<${Bell} ids=${[id]} label=${words.bell.ring} />`;
  if (!mayWrite.value) return html`${bell}${edit}`;
  return html`${bell}${edit}
    ${job.value.kind === 'render' && html`<${LiveButton} isOn=${!!route.value.query.get('live')} toggle=${() => setQuery({live: route.value.query.get('live') ? null : 'on'})} />`}
    ${job.value.kind === 'render' && !job.value.expired && html`<button onClick=${measure} title=${words.playground.measureHelp}>${words.playground.measure}</button><a class="button" href=${`#/batches/new?job=${id}`} title=${words.batches.sweepHelp}>${words.batches.sweep}</a>`}
    ${isOpen && html`<label class="switch">${words.queue.columns.priority}<${Entry} class="priority" type="number" min="0" max="100" value=${priority} onChange=${(/** @type {any} */ event) => setPriority(event.target.value)} /></label>
      <button onClick=${() => { proposed.value = 'cancel'; }}>${words.queue.cancel}</button>`}
    ${mayRetry && html`<button onClick=${retry}>${words.queue.retry}</button>`}
    ${state !== 'running' && html`<button class="danger" onClick=${() => { proposed.value = 'remove'; }}>${words.queue.remove}</button>`}
    <${Dialog} open=${proposed.value !== ''} onClose=${() => { proposed.value = ''; }} title=${text.sure}>${proposed.value && html`<div class="stack"><h2>${words.queue.confirm[proposed.value](1)}</h2>
      <div class="row"><button onClick=${() => { proposed.value = ''; }}>${words.queue.back}</button><button class="primary" onClick=${proposed.value === 'cancel' ? cancel : remove}>${text.doIt[proposed.value]}</button></div></div>`}</${Dialog}>`;
}
