/** Linear images as those that a browser shows. */
import {readExr} from './exr.js';

/** sRGB code of a linear value (IEC 61966-2-1). @param {number} value */
const code = (value) => 255 * (value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055);

/** The colours of an EXR file as a PNG, without exposure. @param {ArrayBuffer} bytes */
export async function developExr(bytes) {
  const {width, height, channels} = await readExr(bytes, ['R', 'G', 'B', 'Y']), gray = channels.Y;
  const pixels = new Uint8ClampedArray(4 * width * height).fill(255);
  [channels.R ?? gray, channels.G ?? gray, channels.B ?? gray].forEach((values, channel) => { for (let i = 0; i < values.length; ++i) pixels[4 * i + channel] = code(values[i]); });
  const canvas = new OffscreenCanvas(width, height);
  /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext('2d')).putImageData(new ImageData(pixels, width, height), 0, 0);
  return canvas.convertToBlob();
}
