/** The page: navigation, figures of the service, and the part that the address names. */
import {effect, signal} from '@preact/signals';
import {render} from 'preact';
import {html} from 'htm/preact';
import {useEffect, useRef} from 'preact/hooks';
import {identify, key, locked, mayWrite, me, setKey} from './api.js';
import {count, duration} from './format.js';
import {addKeys, disabled, helpOpen, setEnabled} from './keys.js';
import {announce, Dialog, Icon, toast, toastRoute} from './parts.js';
import {go, route, routeOf, startRoutes} from './routes.js';
import {acceptDrops} from './scenes.js';
import {serviceState} from './service-state.js';
import {connection, figures, health, rung, startStream} from './store.js';
import {words} from './words.js';

const STORED_THEME = 'whittle.theme';

/** Pages by the first part of the route, and whether they are loaded only when they are opened. @type {Record<string, () => Promise<any>>} */
const PAGES = {
  queue: async () => (await import('./queue.js')).Queue,
  jobs: async () => (await import('./job.js')).JobPage,
  batches: async () => (await import('./batches.js')).Batches,
  system: async () => (await import('./system.js')).System,
  measure: async () => (await import('./measure.js')).Measure,
  compare: async () => (await import('./compare.js')).Compare,
  new: async () => (await import('./playground.js')).Playground,
  edit: async () => (await import('./playground.js')).Playground,
};

// ---- theme

/** 'dark', 'light', or the setting of the system. */
const theme = signal(localStorage.getItem(STORED_THEME) || 'auto');
const systemIsLight = matchMedia('(prefers-color-scheme: light)');

function applyTheme() {
  const light = theme.value === 'light' || (theme.value === 'auto' && systemIsLight.matches);
  document.documentElement.dataset.theme = light ? 'light' : 'dark';
}
systemIsLight.addEventListener('change', applyTheme);
applyTheme();

function nextTheme() {
  const order = ['auto', 'dark', 'light'];
  theme.value = order[(order.indexOf(theme.value) + 1) % order.length];
  localStorage.setItem(STORED_THEME, theme.value);
  applyTheme();
}

// ---- parts of the shell

function Rail() {
  const page = route.value.page;
  const current = page === 'edit' ? 'new' : ['jobs', 'compare', 'measure'].includes(page) ? 'queue' : page;
  const link = (/** @type {'queue' | 'new' | 'batches' | 'system'} */ name, /** @type {string} */ href) =>
    html`<a href=${href} aria-current=${current === name ? 'page' : undefined}><${Icon} name=${name} />${words.pages[name]}</a>`;
  const themeName = words.theme[/** @type {'dark' | 'light' | 'auto'} */ (theme.value)];
  return html`<nav class="rail" aria-label=${words.product}>
    <a class="brand" href="#/" aria-label=${words.product}><img src=${new URL('./icon.svg', import.meta.url).pathname} alt="" /></a>
    ${link('queue', '#/')} ${link('new', '#/new')} ${link('batches', '#/batches')} ${link('system', '#/system')}
    <a href="/docs"><${Icon} name="docs" />${words.pages.docs}</a>
    <span class="spring"></span>
    <button class="keyboard" onClick=${() => { helpOpen.value = true; }} aria-label=${words.keys.title}><${Icon} name="keys" /></button>
    <button onClick=${nextTheme} aria-label=${`${words.theme.label}: ${themeName}`} title=${`${words.theme.label}: ${themeName}`}><${Icon} name="theme" /></button>
  </nav>`;
}

function Header() {
  const isLost = connection.value === 'lost', queue = isLost ? null : figures.value;
  const jobs = queue?.jobs || {};
  const {word, help, isBad} = serviceState(queue, health.value, isLost);
  const state = connection.value === 'locked' ? 'lost' : connection.value;
  return html`<header class="top">
    <span class=${`service ${isBad ? 'bad' : ''}`} role="status"><strong>${word}</strong> ${help}</span>
    ${queue && html`<dl class="number">
      <div><dd>${count(jobs.running)}</dd><dt>${words.status.running}</dt></div>
      <div><dd>${count(jobs.queued)}</dd><dt>${words.status.queued}</dt></div>
      ${jobs.queued > 0 && queue.oldest_age_s >= 1 && html`<div><dt class="before">${words.status.oldest}</dt><dd>${duration(queue.oldest_age_s)}</dd></div>`}
      ${queue.eta_s > 0 && html`<div><dt class="before">${words.status.eta}</dt><dd>${duration(queue.eta_s)}</dd></div>`}
    </dl>`}
    <span class="spring"></span>
    ${me.value?.name && html`<span class="dim">${words.login.as(me.value.name)}${mayWrite.value ? '' : `, ${words.login.readOnly}`}
      <button class="link" onClick=${() => { setKey('', false); location.reload(); }}>${words.login.forget}</button></span>`}
    <span class="light" data-state=${state} title=${words.connectionHelp[state]}>${words.connection[state]}</span>
  </header>`;
}

function KeyDialog() {
  const field = useRef(/** @type {HTMLInputElement | null} */ (null)), remember = useRef(/** @type {HTMLInputElement | null} */ (null));
  const text = words.login;
  const enter = (/** @type {Event} */ event) => {
    event.preventDefault();
    setKey(field.current?.value.trim() || '', remember.current?.checked || false);
    identify();
  };
  return html`<${Dialog} open=${locked.value !== null} onClose=${() => undefined} title=${text.title}>
    <form onSubmit=${enter}>
      <h2>${text.title}</h2>
      <p class="dim">${text.text}</p>
      ${key.value && locked.value && html`<p class="note bad" role="alert">${locked.value.message}</p>`}
      <label>${text.key}<input type="password" ref=${field} autocomplete="off" required autofocus /></label>
      <label class="switch"><input type="checkbox" ref=${remember} />${text.remember}</label>
      <div class="row"><button class="primary" type="submit">${text.enter}</button></div>
    </form>
  </${Dialog}>`;
}

function KeyHelp() {
  const close = () => { helpOpen.value = false; };
  return html`<${Dialog} open=${helpOpen.value} onClose=${close} title=${words.keys.title}><div class="stack">
    <h2>${words.keys.title}</h2>
    <p class="dim">${words.keys.help}</p>
    <div class="key-list">${words.keys.list.map(([name, what]) => html`<kbd>${name === ' ' ? words.keys.space : name}</kbd><span>${what}</span>
      <input type="checkbox" aria-label=${`${what}: ${words.keys.enabled}`} checked=${!disabled.value.has(name)} onChange=${(/** @type {any} */ event) => setEnabled(name, event.target.checked)} />`)}</div>
    <h3>${words.titles.new}</h3><div class="key-list">${words.keys.playground.map(([name, what]) => html`<kbd>${name}</kbd><span>${what}</span><span></span>`)}</div>
    <div class="row"><button onClick=${close}>${words.close}</button></div>
  </div></${Dialog}>`;
}

/** The component of the page that is shown. @type {import('@preact/signals').Signal<{page: string, Component: any} | null>} */
const opened = signal(null);

function Main() {
  const {page, id} = route.value;
  useEffect(() => {
    document.title = `${words.titles[/** @type {'queue'} */ (page)] || words.titles.unknown} · ${words.product}`;
    PAGES[page]?.().then((Component) => {
      if (route.value.page === page) opened.value = {page, Component};
    });
  }, [page, id]);
  const ready = opened.value?.page === page && me.value !== undefined;
  return html`<main id="main" tabindex="-1">
    ${!PAGES[page] ? html`<div class="empty"><h1>${words.titles.unknown}</h1><p>${words.unknownPage}</p><a class="button" href="#/">${words.toQueue}</a></div>`
      : ready ? html`<${/** @type {any} */ (opened.value).Component} key=${page + id} id=${id} />` : html`<p class="visually-hidden">${words.loading}</p>`}
  </main>`;
}

function App() {
  useEffect(() => addKeys({
    '?': () => { helpOpen.value = true; }, 'g q': () => go('#/'), 'g n': () => go('#/new'), 'g b': () => go('#/batches'), 'g s': () => go('#/system'), '/': () => go('#/?q='),
  }), []);
  return html`<div class="shell">
    <a class="skip" href="#main" onClick=${(/** @type {Event} */ event) => { event.preventDefault(); document.getElementById('main')?.focus(); }}>${words.skip}</a>
    <${Header} /><${Main} /><${Rail} />
    <${KeyDialog} /><${KeyHelp} />
    <div aria-live="polite" class=${toast.value ? 'toast' : ''}>${toast.value}${toast.value && toastRoute.value && html` <a href=${toastRoute.value}>${words.bell.open}</a>`}</div>
  </div>`;
}

render(html`<${App} />`, /** @type {HTMLElement} */ (document.getElementById('app')));
identify().catch(() => { setTimeout(() => identify().catch(() => undefined), 1000); });
startStream();
startRoutes();
acceptDrops();
effect(() => { if (rung.value) announce(words.bell.ended(rung.value.name, words.states[/** @type {'failed'} */ (rung.value.state)]), routeOf(rung.value)); });
