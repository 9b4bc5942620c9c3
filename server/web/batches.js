/** Batches: the list, and one batch as a contact sheet or an animation. */
import {useSignal} from '@preact/signals';
import {html} from 'htm/preact';
import {useEffect, useMemo} from 'preact/hooks';
import {getJson, mayWrite, postJson, request} from './api.js';
import {NewBatch} from './batch-form.js';
import {jobsByIndex, Sheet} from './batch-sheet.js';
import {age, count} from './format.js';
import {JobList} from './job-list.js';
import {attempt, Bell, copy, Dialog, download, Failure, State} from './parts.js';
import {Player} from './player.js';
import {go, route, setQuery} from './routes.js';
import {listen} from './store.js';
import {words} from './words.js';

const READ_MS = 1000, FPS = 24;
const text = words.batches;

/** @typedef {Record<string, any>} Batch */
/** @typedef {Record<string, any>} Job */

/** Calls `read` now and after events of batches, at most once a second. @param {() => void} read @param {string} [batch] */
function useEvents(read, batch) {
  useEffect(() => {
    let timer = 0;
    const soon = () => { timer ||= window.setTimeout(() => { timer = 0; read(); }, READ_MS); };
    const stop = listen({event: (event) => { if (event.type !== 'progress' && (batch ? event.batch === batch : event.batch)) soon(); }, reload: soon});
    read();
    return () => { stop(); clearTimeout(timer); };
  }, [batch]);
}

/** @param {{id: string}} properties */
export function Batches({id}) {
  if (id === 'new' && mayWrite.value) return html`<${NewBatch} />`;
  return id && id !== 'new' ? html`<${One} id=${id} />` : html`<${List} />`;
}

function List() {
  const items = useSignal(/** @type {Batch[] | null} */ (null)), cursor = useSignal(/** @type {string | null} */ (null)), problem = useSignal(/** @type {any} */ (null));
  const read = (/** @type {string | null} */ from) => getJson(`/v1/batches${from ? `?cursor=${encodeURIComponent(from)}` : ''}`).then((page) => {
    const first = new Set(page.items.map((/** @type {Batch} */ each) => each.id)), older = (items.value || []).filter((each) => !first.has(each.id));
    if (from) items.value = [...older, ...page.items];
    else {
      items.value = page.next_cursor && page.items.length > 0 ? [...page.items, ...older.filter((each) => each.id < page.items.at(-1).id)] : page.items;
      if (items.value?.length === page.items.length) cursor.value = page.next_cursor;
    }
    if (from) cursor.value = page.next_cursor;
    problem.value = null;
  }, (error) => { problem.value = error; });
  useEvents(() => read(null));
  const create = mayWrite.value && html`<a class="button primary" href="#/batches/new">${text.create}</a>`;
  return html`<div class="page">
    <header class="heading"><h1>${words.titles.batches}</h1><span class="spring"></span>${items.value?.length ? create : ''}</header>
    <${Failure} problem=${problem.value} />
    ${items.value?.length === 0 ? html`<div class="empty"><h2>${text.empty}</h2><p>${text.emptyText}</p>${create}</div>`
      : items.value && html`<section class="panel batch-list"><table class="plain"><thead><tr><th scope="col">${words.queue.columns.name}</th><th scope="col">${words.queue.columns.state}</th>
          <th scope="col" class="wide">${words.queue.columns.progress}</th><th scope="col" class="right">${text.jobs}</th><th scope="col" class="right">${words.queue.columns.age}</th></tr></thead><tbody>
        ${items.value.map((each) => html`<tr key=${each.id} data-id=${each.id}><td><a href=${`#/batches/${each.id}`}>${each.name || words.queue.untitled}</a></td><td><${State} state=${each.state} /></td>
          <td class="wide">${each.progress < 1 && html`<progress max="1" value=${each.progress} aria-label=${words.queue.columns.progress}></progress>`}</td><td class="right number">${count(each.size)}</td>
          <td class="right number">${age(each.created_at, Date.now())}</td></tr>`)}</tbody></table>
        ${cursor.value && html`<button onClick=${() => read(cursor.value)}>${text.more}</button>`}</section>`}
  </div>`;
}

/** @param {{id: string}} properties */
function One({id}) {
  const batch = useSignal(/** @type {Batch | null} */ (null)), problem = useSignal(/** @type {any} */ (null));
  useEvents(() => getJson(`/v1/batches/${id}`).then((body) => { batch.value = body; problem.value = null; }, (error) => { problem.value = error; }), id);
  const list = useMemo(() => new JobList({batch: id}), [id]);
  useEffect(() => () => list.close(), [list]);
  const fps = useSignal(FPS);
  list.version.value;
  useEffect(() => { list.more(); });  // until all jobs are known
  const value = batch.value;
  if (!value) return html`<div class="page">${problem.value ? html`<div class="empty"><h1>${words.titles.batches}</h1><p>${problem.value.message}</p><a class="button" href="#/batches">${text.toList}</a></div>` : html`<p class="dim">${words.loading}</p>`}</div>`;
  const isOpen = value.state === 'queued' || value.state === 'running';
  const jobs = jobsByIndex(list), plays = route.value.query.get('view') === 'player';
  const images = [...jobs].sort(([a], [b]) => a - b).flatMap(([, job]) => !job.expired && job.state === 'succeeded' && job.artifacts.find((/** @type {any} */ each) => each.name === 'image.png') || []);
  const shares = Object.entries(value.jobs).filter(([, n]) => n > 0);
  return html`<div class="page batch">
    <header class="heading"><h1>${value.name || words.queue.untitled}</h1> <${State} state=${value.state} />${isOpen && html`<span class="number">${Math.floor(value.progress * 100)} %</span>`}
      <span class="spring"></span><${Actions} batch=${batch} list=${list} fps=${fps} images=${images.length} /></header>
    ${isOpen && html`<progress max="1" value=${value.progress} aria-label=${words.queue.columns.progress}></progress>`}
    <p class="dim shares">${text.created(count(value.size), age(value.created_at, Date.now()))} ${shares.map(([name, n]) => html`<a href=${`#/?batch=${id}&state=${name}`}><${State} state=${name} /> <span class="number">${count(Number(n))}</span></a>`)}</p>
    <${Failure} problem=${problem.value || list.problem.value} />
    <div class="buttons" role="group" aria-label=${text.view}><button aria-pressed=${!plays} onClick=${() => setQuery({view: null})}>${text.images}</button>
      <button aria-pressed=${plays} onClick=${() => setQuery({view: 'player'})}>${text.animation}</button></div>
    ${!plays ? html`<${Sheet} batch=${value} list=${list} jobs=${jobs} />`
      : images.length > 0 ? html`<${Player} urls=${images.map((each) => each.url)} fps=${fps} size=${jobs.get(0)?.image || {width: 4, height: 3}} />`
      : html`<div class="empty"><h2>${text.noImages}</h2></div>`}
  </div>`;
}

/** @param {{batch: import('@preact/signals').Signal<Batch | null>, list: JobList, fps: import('@preact/signals').Signal<number>, images: number}} properties */
function Actions({batch, list, fps, images}) {
  const proposed = useSignal(/** @type {'' | 'cancel' | 'remove'} */ (''));
  const {id, name, links, jobs} = /** @type {Batch} */ (batch.value);
  const open = (jobs.queued || 0) + (jobs.running || 0);
  useEffect(() => { proposed.value = ''; }, [open === 0]);  // the question is about what was
  const post = (/** @type {string} */ path) => attempt(async () => {
    proposed.value = '';
    batch.value = await postJson(path, undefined);
    list.scheduleReload();
  });
  const remove = () => attempt(async () => { proposed.value = ''; await request('DELETE', `/v1/batches/${id}`); go('#/batches'); });
  const loading = useSignal('');
  const save = (/** @type {string} */ path, /** @type {string} */ kind) => attempt(async () => {
    loading.value = kind;
    await download(path, `${name || id}.${kind}`).finally(() => { loading.value = ''; });
  });
  const button = (/** @type {string} */ path, /** @type {'tar' | 'apng'} */ kind) => html`<button disabled=${loading.value !== ''} aria-busy=${loading.value === kind} onClick=${() => save(path, kind)}>${loading.value === kind ? text.preparing : text[kind]}</button>`;
  const video = `mkdir frames && tar -xf '${(name || id).replaceAll("'", '_')}.tar' -C frames && ffmpeg -framerate ${fps.value} -pattern_type glob -i 'frames/*.png' -vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2' -pix_fmt yuv420p video.mp4`;
  const total = Object.values(jobs).reduce((sum, each) => sum + Number(each), 0);
  return html`${open > 0 && html`<${Bell} ids=${[`batch/${id}`]} label=${words.bell.ringBatch} />`}
    ${links.artifacts && images > 0 && html`${button(links.artifacts, 'tar')}${button(`/v1/batches/${id}/animation.apng?fps=${fps.value}`, 'apng')}<button onClick=${() => copy(video)} title=${video}>${text.video}</button>`}
    ${mayWrite.value && html`${links.retry && html`<button onClick=${() => post(links.retry)}>${text.retry}</button>`}
      ${links.cancel && html`<button onClick=${() => { proposed.value = 'cancel'; }}>${words.queue.cancel}</button>`}
      ${open === 0 && html`<button class="danger" onClick=${() => { proposed.value = 'remove'; }}>${words.queue.remove}</button>`}
      <${Dialog} open=${proposed.value !== ''} onClose=${() => { proposed.value = ''; }} title=${words.job.sure}>${proposed.value && html`<div class="stack"><h2>${words.queue.confirm[proposed.value](proposed.value === 'cancel' ? open : total)}</h2>
        <div class="row"><button onClick=${() => { proposed.value = ''; }}>${words.queue.back}</button>
          <button class="primary" onClick=${proposed.value === 'cancel' ? () => post(links.cancel) : remove}>${words.queue.doIt[proposed.value]}</button></div></div>`}</${Dialog}>`}`;
}
