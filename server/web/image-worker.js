/** Work on bytes apart from the page: layers of EXR files, heat maps, differences of images, SHA-256. */
import {compare} from './diff.js';
import {developExr, readExr} from './exr.js';
import {heatPixels} from './heat.js';
import {sha256} from './sha256.js';

/** @type {Record<string, (message: any) => Promise<any>>} */
const methods = {
  sha256: async ({bytes}) => sha256(bytes),
  compare: async ({a, b}) => compare(a, b),
  exr: async ({bytes, channels}) => readExr(bytes, channels),
  develop: async ({bytes}) => developExr(bytes),
  heat: async ({values, width, height, white}) => {
    const canvas = new OffscreenCanvas(width, height);
    /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext('2d')).putImageData(new ImageData(heatPixels(values, white), width, height), 0, 0);
    return canvas.convertToBlob();
  },
};

onmessage = async ({data}) => {
  try {
    postMessage({id: data.id, result: await methods[data.method](data)});
  } catch (error) {
    postMessage({id: data.id, error: error instanceof Error ? error.message : String(error)});
  }
};
