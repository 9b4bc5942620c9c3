/**
 * The live view of a scene: when it is traced, and in how many pixels. While the camera moves, each frame has one centered sample and as
 * many pixels as the frame rate permits. While it rests, samples of the tracer's sequence accumulate in all pixels, in bands of rows, so
 * that no pass occupies the graphics processor for long.
 */
import {Renderer} from './renderer.js';

export {cameraOf, changesOf, readLive} from './message.js';
export {Renderer, Unsupported} from './renderer.js';

const REST_MS = 200, FRAME_MS = 1000 / 60, SLOW_FRAME_MS = 1000 / 20, BAND_MS = 40;
const PIXELS_MAX = 4 << 20, SCALE_MIN = 1 / 16, COMPARED_SAMPLES = 16;
/** Samples that a image at rest has: those of edges, and of lights and lenses with an extent. */
const SAMPLES = 64, SOFT_SAMPLES = 256;

/** @typedef {import('./renderer.js').Camera} Camera */
/** @typedef {{samples: number, wanted: number, width: number, height: number, rate: number, soft: boolean, truncated: number, distance: number | null}} State */

/** Root mean square difference of two images of one size, in levels. @param {Uint8ClampedArray} a @param {Uint8ClampedArray} b */
export function distanceOf(a, b) {
  let sum = 0;
  for (let i = 0; i < a.length; ++i) sum += i % 4 === 3 ? 0 : (a[i] - b[i]) ** 2;
  return Math.sqrt(sum / (a.length * 0.75));
}

export class LiveView {
  /** @param {HTMLCanvasElement} canvas @param {{onFrame: (state: State) => void, onFailure: (error: Error) => void}} events */
  constructor(canvas, {onFrame, onFailure}) {
    this.canvas = canvas;
    this.onFrame = onFrame;
    this.onFailure = onFailure;
    this.renderer = new Renderer(canvas);
    this.gl = this.renderer.gl;
    /** @type {Camera | null} */
    this.camera = null;
    /** CSS pixels times the density of the screen. */
    this.box = {width: 640, height: 480};
    this.scale = 0.25;
    this.movedAt = -Infinity;
    this.isMoving = false;
    this.rate = 0;
    this.request = 0;
    /** @type {WebGLSync | null} */
    this.fence = null;
    this.begun = 0;
    /** @type {{width: number, height: number, samples: number, next: number, row: number, rows: number, isShown: boolean, codes: Uint8ClampedArray | null} | null} */
    this.pass = null;
    /** @type {{width: number, height: number, codes: Uint8ClampedArray} | null} */
    this.reference = null;
    /** @type {State} */
    this.state = {samples: 0, wanted: 0, width: 0, height: 0, rate: 0, soft: false, truncated: 0, distance: null};
    this.lost = () => this.fail(new Error('context lost'));
    canvas.addEventListener('webglcontextlost', this.lost);
  }

  /** Replaces the scene. @param {import('./message.js').Live} live @param {Camera} camera */
  load(live, camera) {
    this.live = live;
    this.hasLens = camera.aperture > 0;
    this.renderer.load(live, this.hasLens);
    this.move(camera);
  }

  /** @param {Camera} camera */
  move(camera) {
    this.camera = camera;
    this.reference = null;
    if (this.live && camera.aperture > 0 !== this.hasLens) {
      this.hasLens = camera.aperture > 0;
      this.renderer.load(this.live, this.hasLens);
    }
    this.restart();
  }

  /** Writes changed rows of materials or lights. @param {{table: 'materials' | 'lights', cell: number, cells: number}[]} rows */
  update(rows) {
    for (const {table, cell, cells} of rows) this.renderer.update(table, cell, cells);
    this.reference = null;
    this.restart();
  }

  /** @param {number} width @param {number} height of the element, in pixels of the screen */
  resize(width, height) {
    if (width === this.box.width && height === this.box.height) return;
    this.box = {width, height};
    this.restart();
  }

  /** Compares the image with this image when it rests. @param {{width: number, height: number, codes: Uint8ClampedArray} | null} reference */
  compare(reference) {
    this.reference = reference;
    this.state = {...this.state, distance: null};
    if (this.pass?.codes) this.pass = null;
    this.schedule();
  }

  /** Begins again with a quick image. */
  restart() {
    this.movedAt = performance.now();
    this.isMoving = true;
    this.pass = null;
    this.state = {...this.state, samples: 0, distance: null, truncated: 0};
    this.moved = true;
    this.schedule();
  }

  schedule() { if (!this.closed) this.request ||= requestAnimationFrame((now) => { this.request = 0; this.tick(now); }); }

  /** Pixels of the image: those of the element, in the proportions of the document. */
  fullSize() {
    const {width, height} = this.live?.header.image, {box} = this;
    const scale = Math.min(box.width / width, box.height / height, Math.sqrt(PIXELS_MAX / (width * height)));
    return {width: Math.max(1, Math.round(width * scale)), height: Math.max(1, Math.round(height * scale))};
  }

  /** Milliseconds that the last pass took, or nothing while it runs. @param {number} now */
  finished(now) {
    const {gl} = this;
    if (!this.fence) return 0;
    if (gl.clientWaitSync(this.fence, 0, 0) === gl.TIMEOUT_EXPIRED) return null;
    gl.deleteSync(this.fence);
    this.fence = null;
    return now - this.begun;
  }

  /** @param {number} now */
  tick(now) {
    if (this.closed || !this.live || this.gl.isContextLost()) return;
    try {
      if (!this.renderer.ready()) return this.schedule();
    } catch (error) {
      return this.fail(/** @type {Error} */ (error));
    }
    const took = this.finished(now);
    if (took === null) return this.schedule();
    if (this.isMoving && !this.moved && now - this.movedAt >= REST_MS) {
      this.isMoving = false;
      this.pass = null;
    }
    if (this.isMoving) this.drawMoving(took);
    else if (!this.drawResting(took)) return;
    this.schedule();
  }

  begin() {
    this.begun = performance.now();
    this.fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
  }

  /** @param {number} took milliseconds of the frame before */
  drawMoving(took) {
    if (took > 0 && took < 2000) {
      this.rate = this.rate ? this.rate + 0.2 * (1000 / took - this.rate) : 1000 / took;
      // 60 frames a second in a quarter of the pixels or more; below that, 20.
      const wanted = this.scale > 0.5 ? FRAME_MS : SLOW_FRAME_MS;
      if (took > wanted * 1.25) this.scale *= Math.max(0.5, Math.sqrt(wanted / took));
      else if (took < FRAME_MS * 1.25) this.scale *= 1.1;
      this.scale = Math.max(SCALE_MIN, Math.min(1, this.scale));
    }
    if (!this.moved) return;
    this.moved = false;
    const full = this.fullSize(), {renderer} = this, camera = /** @type {Camera} */ (this.camera);
    renderer.clear(Math.max(1, Math.round(full.width * this.scale)), Math.max(1, Math.round(full.height * this.scale)));
    renderer.findMedia(camera);
    renderer.trace(camera, {index: -1, points: 2, share: 1, first: 0, rows: renderer.height});
    renderer.show();
    this.begin();
    this.report({samples: 1, wanted: 0, truncated: 0, distance: null});
  }

  /** False if there is nothing to do. @param {number} took */
  drawResting(took) {
    const {renderer} = this, camera = /** @type {Camera} */ (this.camera);
    if (this.pass && took > 0) this.pass.rows = Math.max(1, Math.min(this.pass.height, Math.floor(this.pass.rows * Math.max(0.25, Math.min(2, BAND_MS / took)))));
    if (this.pass && this.pass.next === this.pass.samples) {
      if (this.pass.codes) {
        this.report({...this.state, distance: distanceOf(renderer.pixels(), this.pass.codes)});
      } else {
        this.report({...this.state, truncated: renderer.overflows()});
      }
      if (!this.reference || this.state.distance !== null) return false;
      this.pass = null;
    }
    if (!this.pass) this.beginPass(camera);
    const pass = /** @type {NonNullable<typeof this.pass>} */ (this.pass), rows = Math.min(pass.rows, pass.height - pass.row);
    renderer.trace(camera, {index: pass.next, points: 1, share: 1 / Math.sqrt(pass.next + 1), first: pass.row, rows});
    pass.row += rows;
    if (pass.row === pass.height) {
      pass.row = 0;
      ++pass.next;
      if (!pass.codes) {
        renderer.show();
        this.report({samples: pass.next, wanted: pass.samples, truncated: 0, distance: null});
      }
    }
    this.begin();
    return true;
  }

  /** Begins with the image, or, once that is complete, with the one that is compared. @param {Camera} camera */
  beginPass(camera) {
    const compared = this.state.samples > 0 && this.state.samples === this.state.wanted ? this.reference : null;
    const {width, height} = compared || this.fullSize();
    const samples = compared ? COMPARED_SAMPLES : this.isSoft() ? SOFT_SAMPLES : SAMPLES;
    const rows = Math.max(1, Math.round(height * Math.min(1, this.scale ** 2)));
    this.pass = {width, height, samples, next: 0, row: 0, rows, isShown: !compared, codes: compared?.codes || null};
    this.renderer.clear(width, height);
    this.renderer.findMedia(camera);
  }

  /** Lights or the lens have an extent, which samples over frames cover. */
  isSoft() { return this.hasLens === true || !!this.live?.header.requirements.includes('soft_lights'); }

  /** @param {{samples: number, wanted: number, truncated: number, distance: number | null}} state */
  report(state) {
    const {width, height} = this.canvas;
    this.state = {...state, width, height, rate: this.rate, soft: this.isSoft()};
    this.onFrame(this.state);
  }

  /** The object that the image shows at a place in [0,1)^2 from its upper left corner. @param {{x: number, y: number}} place */
  pick({x, y}) {
    const {renderer} = this;
    if (!this.camera || !renderer.ready()) return null;
    return renderer.pick(this.camera, Math.floor(x * renderer.width), Math.floor(y * renderer.height));
  }

  /** @param {Error} error */
  fail(error) {
    this.close();
    this.onFailure(error);
  }

  close() {
    if (this.closed) return;
    this.closed = true;
    cancelAnimationFrame(this.request);
    this.canvas.removeEventListener('webglcontextlost', this.lost);
    this.renderer.close();
  }
}
