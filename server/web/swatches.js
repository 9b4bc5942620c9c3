/** Beside colours a swatch that opens the browser's colour chooser; at the number with the cursor a handle that is dragged to change it. */
import {syntaxTree} from '@codemirror/language';
import {isolateHistory} from '@codemirror/commands';
import {Transaction} from '@codemirror/state';
import {Decoration, ViewPlugin, WidgetType} from '@codemirror/view';
import {words} from './words.js';

const COLOR_NAMES = /^"(color|specular|ambient|background|overflow_color|emission|tint|absorption|reflection|transparency)"$/;

/** @param {number} linear */
const toSrgb = (linear) => Math.round(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055));
/** @param {number} byte */
const toLinear = (byte) => byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4;
/** @param {number} value */
const hex = (value) => Math.max(0, Math.min(255, value)).toString(16).padStart(2, '0');

/** "#rrggbb" of "[r, g, b]" (linear) or of a hex string; nothing if the text is neither. @param {string} text */
export function hexColor(text) {
  try {
    const value = JSON.parse(text);
    if (typeof value === 'string') return /^#[0-9a-f]{6}$/i.test(value) ? value.toLowerCase() : null;
    const isColor = Array.isArray(value) && value.length === 3 && value.every((part) => typeof part === 'number' && part >= 0 && part <= 1);
    return isColor ? '#' + value.map((part) => hex(toSrgb(part))).join('') : null;
  } catch {
    return null;
  }
}

/** The text of a chosen colour, in the notation of the old one. @param {string} chosen "#rrggbb" @param {string} before */
export function colorText(chosen, before) {
  if (before.startsWith('"')) return `"${chosen}"`;
  const parts = [1, 3, 5].map((at) => Number(toLinear(parseInt(chosen.slice(at, at + 2), 16)).toPrecision(3)));
  return `[${parts.join(before.includes(', ') ? ', ' : ',')}]`;
}

/**
 * Changes a range step by step; at the end everything is one step of the history.
 * @param {import('@codemirror/view').EditorView} view @param {number} from @param {string} before
 */
function gradualChange(view, from, before) {
  let now = before;
  return {
    /** @param {string} next */
    to(next) {
      if (next === now) return;
      view.dispatch({changes: {from, to: from + now.length, insert: next}, annotations: Transaction.addToHistory.of(false)});
      now = next;
    },
    end() {
      if (now === before) return;
      const last = now;
      this.to(before);
      view.dispatch({changes: {from, to: from + before.length, insert: last}, annotations: isolateHistory.of('full')});
    },
  };
}

class Swatch extends WidgetType {
  /** @param {string} color @param {number} from @param {string} text */
  constructor(color, from, text) { super(); this.color = color; this.from = from; this.text = text; }
  /** @param {Swatch} other */
  eq(other) { return other.color === this.color && other.from === this.from; }
  /** @param {import('@codemirror/view').EditorView} view */
  toDOM(view) {
    const input = document.createElement('input');
    input.type = 'color';
    input.className = 'cm-swatch';
    input.value = this.color;
    input.tabIndex = -1;
    input.setAttribute('aria-label', words.editor.color(this.color));
    /** @type {ReturnType<typeof gradualChange> | undefined} */
    let change;
    input.oninput = () => {
      change ??= gradualChange(view, this.from, this.text);
      change.to(colorText(input.value, this.text));
    };
    input.onchange = () => { change?.end(); change = undefined; };
    return input;
  }
  ignoreEvent() { return true; }
}

class Handle extends WidgetType {
  /** @param {number} from @param {string} text */
  constructor(from, text) { super(); this.from = from; this.text = text; }
  /** @param {Handle} other */
  eq(other) { return other.from === this.from; }
  /** @param {import('@codemirror/view').EditorView} view */
  toDOM(view) {
    const handle = document.createElement('span');
    handle.className = 'cm-handle';
    handle.textContent = '↔';
    handle.title = words.editor.drag;
    handle.setAttribute('aria-hidden', 'true');
    handle.onpointerdown = (down) => {
      down.preventDefault();
      handle.setPointerCapture(down.pointerId);
      const change = gradualChange(view, this.from, this.text);
      const start = Number(this.text);
      const step = Math.max(Math.abs(start), 0.1) / 100;
      handle.onpointermove = (move) => {
        const value = start + Math.round(move.clientX - down.clientX) * step;
        change.to(String(Number.isInteger(start) && Math.abs(start) >= 10 ? Math.round(value) : Number(value.toPrecision(3))));
      };
      handle.onpointerup = handle.onpointercancel = () => {
        handle.onpointermove = null;
        change.end();
      };
    };
    return handle;
  }
  ignoreEvent() { return true; }
}

/** @param {import('@codemirror/view').EditorView} view */
function decorations(view) {
  /** @type {import('@codemirror/state').Range<Decoration>[]} */
  const found = [];
  const cursor = view.state.selection.main.head;
  for (const {from, to} of view.visibleRanges) {
    syntaxTree(view.state).iterate({from, to, enter: (node) => {
      const text = () => view.state.sliceDoc(node.from, node.to);
      if (node.name === 'Number' && cursor >= node.from && cursor <= node.to) {
        found.push(Decoration.widget({widget: new Handle(node.from, text()), side: 1}).range(node.to));
      }
      if (node.name !== 'Property') return;
      const name = node.node.firstChild, value = node.node.lastChild;
      if (!name || !value || value.to - value.from > 60 || !COLOR_NAMES.test(view.state.sliceDoc(name.from, name.to))) return;
      const written = view.state.sliceDoc(value.from, value.to), color = hexColor(written);
      if (color) found.push(Decoration.widget({widget: new Swatch(color, value.from, written), side: -1}).range(value.from));
    }});
  }
  return Decoration.set(found, true);
}

export function swatches() {
  return ViewPlugin.fromClass(class {
    /** @param {import('@codemirror/view').EditorView} view */
    constructor(view) { this.decorations = decorations(view); }
    /** @param {import('@codemirror/view').ViewUpdate} update */
    update(update) {
      // A widget that is being dragged stays: it holds the pointer.
      const inSteps = update.transactions.some((each) => each.annotation(Transaction.addToHistory) === false);
      if (inSteps) this.decorations = this.decorations.map(update.changes);
      else if (update.docChanged || update.selectionSet || update.viewportChanged) this.decorations = decorations(update.view);
    }
  }, {decorations: (plugin) => plugin.decorations});
}
