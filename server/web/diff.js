/** Differences of two images of 8-bit sRGB codes, in levels, as `whittle diff` counts them (tracer/src/compare). */
import {heatColor} from './heat.js';

/**
 * @typedef {object} Difference
 * @property {number} width
 * @property {number} height
 * @property {number} rmse of all channels
 * @property {number} bias mean of b - a
 * @property {number} psnr dB; Infinity for equal images
 * @property {number} share of the pixels that differ by more than 1 level
 * @property {{x: number, y: number, levels: number}} worst
 * @property {number[]} histogram pixels by their greatest difference: 0, 1, 2..3, 4..7, ... 128..255
 * @property {Blob} heat
 * @property {Blob} sign
 */

/** @param {Blob} blob */
async function pixelsOf(blob) {
  const bitmap = await createImageBitmap(blob, {colorSpaceConversion: 'none', premultiplyAlpha: 'none'});
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d'));
  context.drawImage(bitmap, 0, 0);
  return context.getImageData(0, 0, bitmap.width, bitmap.height);
}

/** @param {ImageData} image */
function blobOf(image) {
  const canvas = new OffscreenCanvas(image.width, image.height);
  /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext('2d')).putImageData(image, 0, 0);
  return canvas.convertToBlob();
}

/** @param {Blob} first @param {Blob} second @param {number} [white] levels; by default twice, four times, ... until it is 8 times the error @returns {Promise<Difference & {white: number}>} */
export async function compare(first, second, white) {
  const [a, b] = await Promise.all([pixelsOf(first), pixelsOf(second)]);
  const {width, height} = a;
  if (width !== b.width || height !== b.height) throw new Error(`the sizes differ: ${width} x ${height} and ${b.width} x ${b.height} pixels`);
  const greatest = new Uint8Array(width * height), histogram = new Array(9).fill(0), worst = {x: 0, y: 0, levels: 0};
  let squares = 0, sum = 0, beyond = 0;
  for (let i = 0; i < greatest.length; ++i) {
    for (let channel = 0; channel < 3; ++channel) {
      const difference = b.data[4 * i + channel] - a.data[4 * i + channel];
      squares += difference * difference;
      sum += difference;
      greatest[i] = Math.max(greatest[i], Math.abs(difference));
    }
    if (greatest[i] > worst.levels) Object.assign(worst, {x: i % width, y: Math.floor(i / width), levels: greatest[i]});
    if (greatest[i] > 1) ++beyond;
    ++histogram[greatest[i] === 0 ? 0 : 1 + Math.floor(Math.log2(greatest[i]))];
  }
  const values = 3 * greatest.length, rmse = Math.sqrt(squares / values);
  let scale = white || 1;
  while (!white && scale < 256 && scale < 8 * rmse) scale *= 2;
  const [heat, sign] = maps(a, b, greatest, scale);
  return {width, height, rmse, bias: sum / values, psnr: 20 * Math.log10(255 / rmse), share: beyond / greatest.length, worst, histogram,
          white: scale, heat: await blobOf(heat), sign: await blobOf(sign)};
}

/** The greatest difference as heat; the mean one as blue (darker) and orange (brighter). @param {ImageData} a @param {ImageData} b @param {Uint8Array} greatest @param {number} white */
function maps(a, b, greatest, white) {
  const heat = new ImageData(a.width, a.height), sign = new ImageData(a.width, a.height);
  const colors = Array.from({length: 256}, (_, levels) => heatColor(levels / white));
  for (let i = 0; i < greatest.length; ++i) {
    const at = 4 * i;
    heat.data.set(colors[greatest[i]], at);
    const mean = (b.data[at] - a.data[at] + b.data[at + 1] - a.data[at + 1] + b.data[at + 2] - a.data[at + 2]) / 3;
    const strength = Math.min(1, Math.abs(mean) / white);
    sign.data.set(mean < 0 ? [40, 110 * strength, 40 + 215 * strength] : [40 + 215 * strength, 40 + 110 * strength, 40], at);
    heat.data[at + 3] = sign.data[at + 3] = 255;
  }
  return [heat, sign];
}
