/** The images of a comparison, and what computes their difference: the page for PNGs of two jobs, otherwise the service. */
import {getJson, postJson, request} from './api.js';
import {documentOf} from './job-source.js';
import {words} from './words.js';

const OWN_PIXELS_MAX = 64e6, POLL_MS = 500, PNG = [0x89, 0x50, 0x4e, 0x47], EXR = [0x76, 0x2f, 0x31, 0x01];
const text = words.compare;

/** @typedef {Record<string, any>} Job */
/** @typedef {import('./workers.js').Caller} Caller */
/**
 * @typedef {object} Side
 * @property {string} reference id of a job, ID/FILE for one of its files, or the SHA-256 of an upload
 * @property {string} name
 * @property {Job | null} job none: an upload
 * @property {any} scene null for an upload
 * @property {Blob | null} png the PNG of a job, if the page itself can compare it
 * @property {Blob | null} shown null: of a kind that browsers do not show
 */
/** @typedef {Omit<import('./diff.js').Difference, 'heat' | 'sign' | 'histogram'> & {heat: Blob, white: number, sign?: Blob, histogram?: number[], formats?: string[]}} Found */

/** @param {string} path @returns {Promise<Blob>} */
const bytesAt = async (path) => (await request('GET', path)).blob();

/** A blob that browsers show. @param {Blob} blob @param {Caller} worker */
async function displayable(blob, worker) {
  const first = new Uint8Array(await blob.slice(0, 4).arrayBuffer()), begins = (/** @type {number[]} */ mark) => mark.every((byte, i) => first[i] === byte);
  if (begins(EXR)) return worker.call({method: 'develop', bytes: await blob.arrayBuffer()}).catch(() => null);
  return begins(PNG) || blob.type.startsWith('image/') ? blob : null;
}

/** @param {string} id @param {AbortSignal} signal */
async function endedJob(id, signal) {
  for (;;) {
    const job = await getJson(`/v1/jobs/${id}`, {signal});
    if (job.state !== 'queued' && job.state !== 'running') return job;
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
  }
}

/** The PNG of a job if the page can compare it. @param {Job} job @param {string} file of the job; empty: any */
export function ownPng(job, file) {
  const isSmall = job.image && job.image.width * job.image.height <= OWN_PIXELS_MAX;
  return isSmall && (file === '' || file === 'image.png') ? job.artifacts.find((/** @type {any} */ each) => each.name === 'image.png') || null : null;
}

/** Waits for a job to end. @param {string} reference @param {Caller} worker @param {AbortSignal} signal @returns {Promise<Side>} */
export async function load(reference, worker, signal) {
  const [id, file = ''] = reference.split('/');
  if (/^[0-9a-f]{64}$/.test(id)) return {reference, name: text.upload(id.slice(0, 8)), job: null, scene: null, png: null, shown: await displayable(await bytesAt(`/v1/assets/${id}`), worker)};
  const job = await endedJob(id, signal), name = `${job.name || words.queue.untitled}${file && ` (${file})`}`, png = ownPng(job, file);
  const images = job.artifacts.filter((/** @type {any} */ each) => each.name === file || (file === '' && each.name.startsWith('image.')));
  if (images.length === 0 || job.expired) throw new Error(text.noImage(name));
  const scene = documentOf(id).then(JSON.parse);
  if (png) {
    const blob = await bytesAt(png.url);
    return {reference, name, job, scene: await scene, png: blob, shown: blob};
  }
  const hasPng = images.some((/** @type {any} */ each) => each.name === 'image.png');
  const path = hasPng ? `/v1/jobs/${id}/preview?max=1024` : file === '' || file === 'image.exr' ? `/v1/jobs/${id}/view.png?max=2048` : images[0].url;
  return {reference, name, job, scene: await scene, png: null, shown: await displayable(await bytesAt(path), worker)};
}

/** @param {[Side, Side]} sides @param {Caller} worker @returns {Promise<Found>} */
export async function difference([a, b], worker) {
  if (a.png && b.png) return worker.call({method: 'compare', a: a.png, b: b.png});
  const {formats, width, height, rmse, bias, psnr_db, differing, worst, greatest, heat_map, heat_white} = await postJson('/v1/compare', {a: a.reference, b: b.reference, heat: true});
  return {formats, width, height, rmse, bias, psnr: psnr_db ?? Infinity, share: differing, worst: {x: worst[0]?.x ?? 0, y: worst[0]?.y ?? 0, levels: greatest}, white: heat_white, heat: await bytesAt(heat_map)};
}
