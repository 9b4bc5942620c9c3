/** Routes of the page, in the fragment: "#/jobs/ID?tab=error". Ids of jobs are in no log of a proxy. */
import {signal} from '@preact/signals';

/** @typedef {{page: string, id: string, query: URLSearchParams}} Route */

/** An id as it is if it is not well encoded: there is nothing of that name. @param {string} id */
function decoded(id) {
  try {
    return decodeURIComponent(id);
  } catch {
    return id;
  }
}

/** @param {string} hash @returns {Route} */
export function parseRoute(hash) {
  const [path, query = ''] = hash.replace(/^#\/?/, '').split('?');
  const [page, id = ''] = path.split('/');
  return {page: page || 'queue', id: decoded(id), query: new URLSearchParams(query)};
}

export const route = signal(parseRoute(location.hash));
addEventListener('hashchange', () => { route.value = parseRoute(location.hash); });

/** Route of the page of a job or a batch. @param {{id: string, kind: string}} shown */
export const routeOf = ({id, kind}) => `#/${kind === 'measure' ? 'measure' : kind === 'batch' ? 'batches' : 'jobs'}/${id}`;

/** @param {string} hash */
export function go(hash) { location.hash = hash; }

/** Changes parameters of the present route without an entry in the history. @param {Record<string, string | null>} changes */
export function setQuery(changes) {
  const {page, id, query} = route.value;
  const next = new URLSearchParams(query);
  for (const [name, value] of Object.entries(changes)) value === null ? next.delete(name) : next.set(name, value);
  const text = next.toString();
  history.replaceState(null, '', `#/${page === 'queue' ? '' : page}${id && '/' + id}${text && '?' + text}`);
  route.value = parseRoute(location.hash);
}
