/** Colours of heat maps: cubehelix (Green 2011), as `whittle diff --heat`. */

/** @param {number} fraction 0: black, 1: white @returns {[number, number, number]} bytes */
export function heatColor(fraction) {
  const f = Math.max(0, Math.min(1, fraction));
  const angle = 2 * Math.PI * (0.5 / 3 + 1 - 1.5 * f), amplitude = f * (1 - f) / 2;
  const c = amplitude * Math.cos(angle), s = amplitude * Math.sin(angle);
  const byte = (/** @type {number} */ value) => Math.round(255 * Math.max(0, Math.min(1, value)));
  return [byte(f - 0.14861 * c + 1.78277 * s), byte(f - 0.29227 * c - 0.90649 * s), byte(f + 1.97294 * c)];
}

/** An image of values. @param {Float32Array} values @param {number} white the value that is white */
export function heatPixels(values, white) {
  const table = Array.from({length: 1025}, (_, i) => heatColor(i / 1024));
  const pixels = new Uint8ClampedArray(4 * values.length);
  for (let i = 0; i < values.length; ++i) {
    const share = values[i] / white;
    pixels.set(table[share >= 0 ? Math.min(1024, Math.round(share * 1024)) : 0], 4 * i);
    pixels[4 * i + 3] = 255;
  }
  return pixels;
}
