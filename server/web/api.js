/** Requests to the service with the user's key. Failures are problems (RFC 9457) with the server's own sentence. */
import {computed, signal} from '@preact/signals';
import {words} from './words.js';

const STORED_KEY = 'whittle.key';

/** @typedef {{pointer: string, code: string, detail: string}} Issue */
/** @typedef {{name: string | null, scopes: string[], quotas: Record<string, number>, used: Record<string, number>}} Me */

export class Problem extends Error {
  /** @param {number} status 0: no reply @param {Record<string, any>} body */
  constructor(status, body) {
    super(body.detail || body.title || words.noReply);
    this.status = status;
    this.code = String(body.type || '').replace('urn:whittle:problem:', '');
    this.requestId = body.request_id || '';
    /** @type {Issue[]} */
    this.errors = body.errors || [];
  }
}

export const key = signal(sessionStorage.getItem(STORED_KEY) || localStorage.getItem(STORED_KEY) || '');
/** Undefined until known. @type {import('@preact/signals').Signal<Me | undefined>} */
export const me = signal(undefined);
/** The sentence of the last 401; null while the key is valid or none is needed. @type {import('@preact/signals').Signal<Problem | null>} */
export const locked = signal(null);
/** Controls that change something exist only then. */
export const mayWrite = computed(() => !!me.value && me.value.scopes.some((scope) => scope === 'jobs:write' || scope === 'admin'));

/** @param {string} value @param {boolean} remember also after the browser was closed */
export function setKey(value, remember) {
  sessionStorage.setItem(STORED_KEY, value);
  if (remember) localStorage.setItem(STORED_KEY, value);
  else localStorage.removeItem(STORED_KEY);
  key.value = value;
}

/** Headers of every request. @param {Record<string, string>} [more] @returns {Record<string, string>} */
export function withKey(more = {}) {
  return key.value ? {...more, Authorization: `Bearer ${key.value}`} : more;
}

/**
 * @typedef {object} Options
 * @property {any} [json] the body, as an object or as text
 * @property {Blob} [bytes] the body
 * @property {Record<string, string>} [headers]
 * @property {AbortSignal} [signal]
 */

/** The reply, if it succeeded. @param {string} method @param {string} path @param {Options} [options] */
export async function request(method, path, {json, bytes, headers = {}, signal} = {}) {
  const body = json === undefined ? bytes : typeof json === 'string' ? json : JSON.stringify(json);
  /** @type {Record<string, string>} */
  const type = json === undefined ? {} : {'Content-Type': 'application/json'};
  let reply;
  try {
    reply = await fetch(path, {method, body, signal, headers: withKey({...type, ...headers}), credentials: 'omit'});
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new Problem(0, {detail: words.noReply});
  }
  if (reply.ok || reply.status === 304) return reply;
  const problem = new Problem(reply.status, await reply.json().catch(() => ({detail: `${reply.status} ${reply.statusText}`})));
  if (reply.status === 401) locked.value = problem;
  throw problem;
}

/** @param {string} path @param {Options} [options] @returns {Promise<any>} */
export async function getJson(path, options) { return (await request('GET', path, options)).json(); }

/** @param {string} path @param {any} json @param {Options} [options] @returns {Promise<any>} */
export async function postJson(path, json, options) { return (await request('POST', path, {...options, json})).json(); }

/** Finds out who the user is; opens the dialog for the key if one is needed. */
export async function identify() {
  try {
    me.value = await getJson('/v1/me');
    locked.value = null;
  } catch (error) {
    if (!(error instanceof Problem) || error.status !== 401) throw error;
  }
}
