/** Single keys as commands, off in text fields; each can be switched off (WCAG 2.1.4). */
import {signal} from '@preact/signals';

const STORED = 'whittle.keys.off', SEQUENCE_MS = 1000;

export const DIGITS = '1 … 7';
export const helpOpen = signal(false);
export const disabled = signal(new Set(/** @type {string[]} */ (JSON.parse(localStorage.getItem(STORED) || '[]'))));

/** @typedef {(key: string) => void} Command takes the key that was pressed */
/** @type {Map<string, Command[]>} */
const commands = new Map();
let prefix = '', prefixAt = 0;

/** Registers commands while a part of the page is shown. @param {Record<string, Command>} added by key; DIGITS: any of them @returns {() => void} removes them */
export function addKeys(added) {
  for (const [name, run] of Object.entries(added)) commands.set(name, [...(commands.get(name) || []), run]);
  return () => {
    for (const [name, run] of Object.entries(added)) commands.set(name, (commands.get(name) || []).filter((each) => each !== run));
  };
}

/** @param {string} name @param {boolean} on */
export function setEnabled(name, on) {
  const next = new Set(disabled.value);
  on ? next.delete(name) : next.add(name);
  disabled.value = next;
  localStorage.setItem(STORED, JSON.stringify([...next]));
}

/** @param {EventTarget | null} target */
const isTextField = (target) => target instanceof HTMLElement && (target.shadowRoot !== null || target.isContentEditable || /^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName)
  && !(target instanceof HTMLInputElement && /^(checkbox|button|radio)$/.test(target.type)));

window.addEventListener('keydown', (event) => {
  if (document.querySelector('dialog[open]')) {  // its keys are its own
    prefix = '';
    return;
  }
  if (event.ctrlKey || event.metaKey || event.altKey || (isTextField(event.target) && event.key !== 'Escape')) return;
  const isControl = event.target instanceof HTMLElement && event.target.closest('a, button, summary, input');
  if (/^(Enter| )$/.test(event.key) && isControl) return;  // it has a meaning there
  const inSequence = prefix && performance.now() - prefixAt < SEQUENCE_MS;
  const single = event.key === 'Escape' ? 'Esc' : /^[1-7]$/.test(event.key) ? DIGITS : event.key;
  const name = inSequence ? `${prefix} ${event.key}` : single;
  prefix = '';
  if (!inSequence && single === 'g') {
    prefix = 'g';
    prefixAt = performance.now();
    return;
  }
  const run = (commands.get(name) || []).at(-1);
  if (!run || disabled.value.has(name)) return;
  event.preventDefault();
  run(event.key);
});
