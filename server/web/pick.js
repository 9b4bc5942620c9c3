/** The part of a document that a place in its image shows. */
import {request} from './api.js';
import {readExr} from './exr.js';

/**
 * The pointer of the object, or of the visible light, with a number of the layer `object_id`: objects are counted from 1 in the order
 * of the document, each of a placed prototype once more, then the visible lights. An object in an instance has the instance's pointer.
 * @param {any} scene @param {number} id @returns {string | null} null for the background
 */
export function pointerOf(scene, id) {
  /** @type {Map<string, number>} */
  const sizes = new Map();
  const sizeOf = (/** @type {any} */ object) => {
    if (object.type !== 'instance') return 1;
    const known = sizes.get(object.of);
    if (known !== undefined) return known;
    const size = (scene.prototypes[object.of] || []).reduce((/** @type {number} */ sum, /** @type {any} */ each) => sum + sizeOf(each), 0);
    sizes.set(object.of, size);
    return size;
  };
  let left = id;
  for (const [index, object] of (scene.objects || []).entries()) {
    left -= sizeOf(object);
    if (id > 0 && left <= 0) return `/objects/${index}`;
  }
  for (const [index, light] of (scene.lights || []).entries()) {
    if (light.visible && --left === 0) return `/lights/${index}`;
  }
  return null;
}

/**
 * Renders one pixel with its object.
 * @param {any} scene valid @param {{x: number, y: number}} place in parts of the whole image, from its upper left corner
 * @param {{width: number, height: number}} size of documents that name none
 */
export async function pick(scene, place, size) {
  const width = scene.image?.width ?? size.width, height = scene.image?.height ?? size.height;
  const x = Math.min(width - 1, Math.floor(place.x * width)), y = Math.min(height - 1, Math.floor(place.y * height));
  const document = {
    ...scene,
    image: {width, height, crop: [x, y, x + 1, y + 1]},
    accuracy: {samples: [1, 1], max_depth: 0},
    output: {formats: ['exr'], layers: ['object_id']},
    job: {keep: false, priority: 100, cache: 'off'},
  };
  const reply = await request('POST', '/v1/render', {json: document, headers: {Accept: 'image/x-exr'}});
  const {channels} = await readExr(await reply.arrayBuffer());
  return pointerOf(scene, channels.object_id[0]);
}

/**
 * The place of a pointer in an image that is fitted into its element.
 * @param {HTMLImageElement | HTMLCanvasElement} image @param {{clientX: number, clientY: number}} pointer @returns {{x: number, y: number} | null} null beside the image
 */
export function placeIn(image, {clientX, clientY}) {
  const [width, height] = image instanceof HTMLCanvasElement ? [image.width, image.height] : [image.naturalWidth, image.naturalHeight];
  const box = image.getBoundingClientRect(), scale = Math.min(box.width / width, box.height / height);
  const x = 0.5 + (clientX - box.left - box.width / 2) / (scale * width);
  const y = 0.5 + (clientY - box.top - box.height / 2) / (scale * height);
  return x >= 0 && x < 1 && y >= 0 && y < 1 ? {x, y} : null;
}
