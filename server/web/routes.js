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

/** Follows the address, and keeps the place of each entry of the history. */
export function startRoutes() {
  history.replaceState({...history.state, entry}, '');
  addEventListener('hashchange', () => {
    leave();
    route.value = parseRoute(location.hash);
    enter();
  });
}

// ---- the way back: an entry of the history keeps where the page was scrolled and what had the focus

/** @typedef {{scrolls: [string, number][], focus: string}} Place */
const BOXES = ['main', '.rows', '.tab', '.axes'], RETURN_MS = 5000;
/** By the key of the entry. @type {Map<number, Place>} */
const places = new Map();
let entry = Date.now();  // those of an earlier load are no others'

/** A selector of the element with the focus, if it stands for something that a later page has too. */
function focused() {
  const element = document.activeElement, row = element?.closest('[data-id]');
  if (row) return `[data-id="${/** @type {HTMLElement} */ (row).dataset.id}"] ${element?.tagName}`;
  return element?.hasAttribute('href') ? `[href="${CSS.escape(element.getAttribute('href') || '')}"]` : '';
}

/** Keeps the place in the entry that the page still shows. */
function leave() {
  const scrolls = BOXES.map((box) => /** @type {[string, number]} */ ([box, document.querySelector(box)?.scrollTop || 0]));
  places.set(entry, {scrolls: scrolls.filter(([, top]) => top > 0), focus: focused()});
}

/** A new entry begins at its top; one that was left before is shown as it was. */
function enter() {
  const place = places.get(history.state?.entry);
  entry = history.state?.entry ?? Date.now() + places.size;
  history.replaceState({...history.state, entry}, '');
  if (place) comeBack(place);
  else document.getElementById('main')?.scrollTo(0, 0);
}

/** Scrolls and focuses as soon as the page has that much, unless the user does something before. @param {Place} place */
function comeBack({scrolls, focus}) {
  const wanted = new Map(scrolls), main = /** @type {Node} */ (document.getElementById('main'));
  const step = () => {
    for (const [box, top] of wanted) {
      const element = document.querySelector(box);
      if (element) element.scrollTop = top;
      if (element && Math.abs(element.scrollTop - top) < 2) wanted.delete(box);
    }
    const element = focus && wanted.size === 0 ? document.querySelector(focus) : null;
    if (element) /** @type {HTMLElement} */ (element).focus({preventScroll: true});
    if (wanted.size === 0 && (element || !focus)) stop();
  };
  const observer = new MutationObserver(step), timer = setTimeout(() => stop(), RETURN_MS), ends = ['pointerdown', 'wheel', 'keydown', 'hashchange'];
  const stop = () => { observer.disconnect(); clearTimeout(timer); ends.forEach((name) => removeEventListener(name, stop)); };
  ends.forEach((name) => addEventListener(name, stop));
  observer.observe(main, {childList: true, subtree: true});
}

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
  history.replaceState(history.state, '', `#/${page === 'queue' ? '' : page}${id && '/' + id}${text && '?' + text}`);
  route.value = parseRoute(location.hash);
}
