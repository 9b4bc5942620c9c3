/** State of the service, in one word, and what to do about it. */
import {size} from './format.js';
import {words} from './words.js';

/** @typedef {{ready: boolean, reason: string, draining: boolean, disk: {free_bytes: number, reserve_bytes: number}, limits: {queued_jobs: number}}} Health what the page keeps of GET /v1/status */

/**
 * @param {any} queue GET /v1/queue; null: not known yet
 * @param {Health | null} health
 * @param {boolean} [isLost] the service does not answer
 * @returns {{word: string, help: string, isBad: boolean}}
 */
export function serviceState(queue, health, isLost = false) {
  const {service, serviceHelp} = words;
  const bad = (/** @type {string} */ word, /** @type {string} */ help) => ({word, help, isBad: true});
  if (isLost) return bad(service.lost, serviceHelp.lost);
  if (health?.draining) return bad(service.draining, serviceHelp.draining);
  if (health && !health.ready) {
    if (health.reason.startsWith('disk:')) return bad(service.disk, serviceHelp.disk(size(health.disk.free_bytes), size(health.disk.reserve_bytes)));
    return health.reason.startsWith('store:') ? bad(service.store, serviceHelp.store) : bad(service.notReady, health.reason);
  }
  if (!queue) return {word: '', help: '', isBad: false};
  if (health && queue.jobs.queued >= health.limits.queued_jobs) return bad(service.full, serviceHelp.full);
  return {word: queue.jobs.running > 0 ? service.busy : queue.jobs.queued > 0 ? service.waiting : service.idle, help: '', isBad: false};
}
