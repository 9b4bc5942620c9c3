/** Traces a scene in a fragment shader: tables as textures, one program for the features that the scene needs. */
import {cross, length, scaled, sub, unit} from '../orbit.js';
// @ts-ignore: a text
import shading from './shading.glsl';
// @ts-ignore: a text
import shapes from './shapes.glsl';
// @ts-ignore: a text
import textures from './textures.glsl';
// @ts-ignore: a text
import trace from './trace.glsl';

const COLUMNS = 2048, RAYS_MAX = 24, NO_DEPTH = 2 ** 30;
/** Russian roulette of fixed samples: tracer/accuracy.h. */
const ROULETTE = 1 / 128, LATE_DEPTH = 40;
const CORNERS = '#version 300 es\nvoid main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }';
/** Values of the uniform `mode`. */
const RADIANCE = 0, OBJECT = 1, MEDIA = 2;

/** From linear light to the display (tracer/src/display). `sums` has the sums of the samples of each pixel and their number. */
const DISPLAY = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D sums;
uniform float exposure;  // factor
uniform bool reinhard;
out vec4 shown;

// IEC 61966-2-1
vec3 srgb(vec3 c) {
  return mix(12.92 * c, 1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
}

void main() {
  vec4 sum = texelFetch(sums, ivec2(gl_FragCoord.xy), 0);
  vec3 radiance = sum.rgb / max(floor(sum.a), 1.0) * exposure;
  vec3 tone = reinhard ? mix(radiance / (1.0 + radiance), vec3(1.0), greaterThan(radiance, vec3(1e20))) : min(radiance, 1.0);
  shown = vec4(srgb(tone), 1.0);
}
`;

/** @typedef {import('./message.js').Live} Live */
/** @typedef {import('../orbit.js').Vec} Vec */
/** @typedef {{type: string, position: Vec, look_at: Vec, up: Vec, fov: number, height: number, aperture: number, focus_distance: number | null}} Camera */

/** The camera of a scene in the terms of the shader: tracer/src/cameras/compiled_camera.h. @param {import('./message.js').Header} header @param {Camera} camera @param {number} width @param {number} height */
function viewUniforms({origin, scale}, camera, width, height) {
  const forward = unit(sub(camera.look_at, camera.position)), right = unit(cross(forward, unit(camera.up)));
  const types = ['perspective', 'orthographic', 'panorama'];
  const side = camera.type === 'perspective' ? 2 * Math.tan(camera.fov * Math.PI / 360) / height : camera.height * scale / height;
  const focus = camera.focus_distance ?? length(sub(camera.look_at, camera.position));
  return {
    camera_type: types.indexOf(camera.type), eye: scaled(sub(camera.position, origin), scale), forward, right, up: cross(right, forward),
    pixel: camera.type === 'panorama' ? [2 * Math.PI / width, Math.PI / height] : [side, side], lens: [camera.aperture * scale / 2, focus * scale],
  };
}

/** The `#define`s of a scene: those of its requirements, and what its tables have. @param {Live} live @param {boolean} hasLens */
function definesOf({header, tables}, hasLens) {
  const needs = new Set(header.requirements);
  for (const name of ['layers', 'gouraud', 'many_lights', 'lens']) needs.delete(name);
  if (hasLens) needs.add('lens');
  if (tables.nodes.rows > 0) needs.add('nodes');
  if (tables.lights.rows > 0) needs.add('lights');
  const {values} = tables.objects, step = 4 * header.object_cells;
  const hasMedia = needs.has('absorption') || Array.from({length: values.length / step}, (_, i) => values[i * step + 1]).some((flags) => flags >= 4);
  if (hasMedia) needs.add('media');
  const rays = Math.min((header.accuracy.max_depth ?? NO_DEPTH) + 2, RAYS_MAX);
  return [...[...needs].sort().map((name) => `#define ${name.toUpperCase()}`), ...Object.entries(header.material_fields).map(([name, at]) => `#define AT_${name.toUpperCase()} ${at}`),
    `#define OBJECT_CELLS ${header.object_cells}`, `#define MATERIAL_CELLS ${header.material_cells}`, `#define RAYS ${rays}`].join('\n');
}

/**
 * Albedos of facets with f0 = 1 and with f90 = 1: AlbedoTable of tracer/src/materials/principled.cpp. Rows are those of the roughness, columns of the root of the
 * cosine; the last one has their means over all directions.
 */
function facetAlbedos() {
  const size = 32, columns = size + 1, values = new Float32Array(4 * size * columns);
  const turns = Array.from({length: size ** 2}, (_, sample) => [...sample.toString(2)].reverse().reduce((sum, bit, i) => sum + Number(bit) / 2 ** (i + 1), 0));
  for (let row = 0; row < size; ++row) {
    const alpha = Math.max((row / (size - 1)) ** 2, 1e-6), first = 4 * row * columns;
    for (let i = 0; i < size; ++i) {
      const cosine = Math.max((i / (size - 1)) ** 2, 1e-4), sine = Math.sqrt(1 - cosine * cosine);
      const long = Math.sqrt((alpha * sine) ** 2 + cosine * cosine), across = alpha * sine / long, up = cosine / long, lift = (1 + up) / 2;
      let normal = 0, grazing = 0;
      for (let sample = 0; sample < size * size; ++sample) {
        const radius = Math.sqrt((sample + 0.5) / size ** 2), angle = 2 * Math.PI * turns[sample];
        const x = radius * Math.cos(angle), y = (1 - lift) * Math.sqrt(1 - x * x) + lift * radius * Math.sin(angle), z = Math.sqrt(Math.max(0, 1 - x * x - y * y));
        const facet = [alpha * (across * z - up * y), alpha * x, Math.max(across * y + up * z, 0)], size_of_facet = Math.sqrt(facet[0] ** 2 + facet[1] ** 2 + facet[2] ** 2);
        const between = (sine * facet[0] + cosine * facet[2]) / size_of_facet, light = 2 * between * facet[2] / size_of_facet - cosine;
        if (!(light > 0)) continue;
        const root = (/** @type {number} */ c) => Math.sqrt(alpha * alpha + (1 - alpha * alpha) * c * c);
        const weight = light * (cosine + root(cosine)) / (cosine * root(light) + light * root(cosine)), part = (1 - Math.min(between, 1)) ** 5;
        normal += weight * (1 - part) / size ** 2;
        grazing += weight * part / size ** 2;
      }
      values.set([normal, grazing], first + 4 * i);
    }
    for (let channel = 0; channel < 2; ++channel)  // over the root: 2 c dc = 4 root^3 droot
      for (let i = 0; i < 256; ++i) {
        const root = (i + 0.5) / 256, at = Math.floor(root * (size - 1)), part = root * (size - 1) - at, left = first + 4 * at + channel;
        values[first + 4 * size + channel] += root ** 3 / 64 * (values[left] * (1 - part) + values[left + 4] * part);
      }
  }
  return values;
}
/** @type {Float32Array | undefined} */
let albedos;

/** Why the browser cannot trace. */
export class Unsupported extends Error {}

export class Renderer {
  /** @param {HTMLCanvasElement | OffscreenCanvas} canvas */
  constructor(canvas) {
    const gl = /** @type {WebGL2RenderingContext | null} */ (canvas.getContext('webgl2', {alpha: false, antialias: false, depth: false, powerPreference: 'high-performance'}));
    if (!gl?.getExtension('EXT_color_buffer_float')) throw new Unsupported('WebGL2');
    this.gl = gl;
    this.canvas = canvas;
    this.parallel = gl.getExtension('KHR_parallel_shader_compile');
    this.sumFormat = gl.getExtension('EXT_float_blend') ? gl.RGBA32F : gl.RGBA16F;
    /** @type {Map<string, WebGLProgram>} by its defines */
    this.programs = new Map();
    /** @type {Map<WebGLProgram, {name: string, type: number, at: WebGLUniformLocation | null}[]>} */
    this.uniforms = new Map();
    /** @type {Map<string, WebGLTexture>} */
    this.textures = new Map();
    this.display = this.link(DISPLAY);
    this.target = gl.createFramebuffer();
    this.media = this.texture(gl.RGBA32F, 1, 1, gl.RGBA, gl.FLOAT, null);
    this.single = this.texture(gl.RGBA32F, 1, 1, gl.RGBA, gl.FLOAT, null);
    /** @type {WebGLTexture | null} */
    this.sums = null;
    this.width = this.height = 0;
    /** @type {Live | null} */
    this.live = null;
    /** @type {WebGLProgram | null} */
    this.program = null;
  }

  /** @param {string} fragment */
  link(fragment) {
    const {gl} = this, program = /** @type {WebGLProgram} */ (gl.createProgram());
    for (const [kind, source] of [[gl.VERTEX_SHADER, CORNERS], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = /** @type {WebGLShader} */ (gl.createShader(Number(kind)));
      gl.shaderSource(shader, String(source));
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    return program;
  }

  /** @param {WebGLProgram} program */
  check(program) {
    const {gl} = this;
    if (gl.isContextLost() || gl.getProgramParameter(program, gl.LINK_STATUS)) return;
    const logs = (gl.getAttachedShaders(program) || []).map((shader) => gl.getShaderInfoLog(shader));
    throw new Unsupported([gl.getProgramInfoLog(program), ...logs].join('\n').slice(0, 2000));
  }

  /** @param {number} internal @param {number} width @param {number} height @param {number} format @param {number} type @param {ArrayBufferView | null} values */
  texture(internal, width, height, format, type, values) {
    const {gl} = this, texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, type, values);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    return texture;
  }

  /** Replaces the scene. @param {Live} live @param {boolean} hasLens */
  load(live, hasLens) {
    const {gl} = this;
    this.live = live;
    for (const texture of this.textures.values()) gl.deleteTexture(texture);
    this.textures.clear();
    for (const [name, table] of Object.entries(live.tables)) {
      const rows = Math.max(1, Math.ceil(table.rows / COLUMNS)), width = rows > 1 ? COLUMNS : Math.max(1, table.rows);
      const words = rows * width * table.columns;
      let values = table.values;
      if (values.length !== words) {
        values = new (/** @type {any} */ (values.constructor))(words);
        values.set(table.values);
      }
      const isFloat = values instanceof Float32Array;
      this.textures.set(name, /** @type {WebGLTexture} */ (isFloat ? this.texture(gl.RGBA32F, width, rows, gl.RGBA, gl.FLOAT, values)
        : this.texture(gl.RG32UI, width, rows, gl.RG_INTEGER, gl.UNSIGNED_INT, values)));
    }
    if (live.header.requirements.includes('principled'))
      this.textures.set('albedos', /** @type {WebGLTexture} */ (this.texture(gl.RGBA32F, 33, 32, gl.RGBA, gl.FLOAT, albedos ??= facetAlbedos())));
    const defines = definesOf(live, hasLens);
    let program = this.programs.get(defines);
    if (!program) this.programs.set(defines, program = this.link(`#version 300 es\n${defines}\n${shapes}${textures}${shading}${trace}`));
    this.program = program;
  }

  /** False while the driver compiles the program. */
  ready() {
    const {gl} = this;
    if (!this.program || gl.isContextLost()) return false;
    if (this.parallel && !gl.getProgramParameter(this.program, this.parallel.COMPLETION_STATUS_KHR)) return false;
    this.check(this.program);
    return true;
  }

  /** Writes a row of `materials` or `lights` again. @param {'materials' | 'lights'} name @param {number} cell @param {number} cells */
  update(name, cell, cells) {
    const {gl} = this, texture = this.textures.get(name), table = this.live?.tables[name];
    if (!texture || !table) return;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (let at = cell; at < cell + cells; ++at)
      gl.texSubImage2D(gl.TEXTURE_2D, 0, at % COLUMNS, Math.floor(at / COLUMNS), 1, 1, gl.RGBA, gl.FLOAT, table.values.subarray(4 * at, 4 * at + 4));
  }

  /** Forgets all samples. @param {number} width @param {number} height */
  clear(width, height) {
    const {gl} = this;
    if (width !== this.width || height !== this.height || !this.sums) {
      gl.deleteTexture(this.sums);
      this.sums = this.texture(this.sumFormat, width, height, gl.RGBA, this.sumFormat === gl.RGBA32F ? gl.FLOAT : gl.HALF_FLOAT, null);
      this.width = width;
      this.height = height;
    }
    this.bind(this.sums);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
  }

  /** @param {WebGLTexture | null} texture to draw into; null: the canvas */
  bind(texture) {
    const {gl} = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, texture ? this.target : null);
    if (texture) gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  }

  /** @param {WebGLProgram} program */
  uniformsOf(program) {
    const {gl} = this;
    let found = this.uniforms.get(program);
    if (!found) {
      const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
      found = Array.from({length: count}, (_, i) => {
        const {name, type} = /** @type {WebGLActiveInfo} */ (gl.getActiveUniform(program, i));
        return {name, type, at: gl.getUniformLocation(program, name)};
      });
      this.uniforms.set(program, found);
    }
    return found;
  }

  /** Sets the uniforms of a pass. @param {Camera} camera @param {Record<string, number | number[]>} more */
  use(camera, more) {
    const {gl, live} = this, program = /** @type {WebGLProgram} */ (this.program);
    if (!live) throw new Error('no scene');
    gl.useProgram(program);
    const {header, tables} = live, {medium, accuracy, depth_cue: cue} = header;
    const all = {
      ...viewUniforms(header, camera, this.width, this.height), size: [this.width, this.height], corner: [0, 0], mode: RADIANCE, sample_index: -1, light_points: 1, share: 1,
      world_per_render: 1 / header.scale, ambient: header.ambient, outside_absorption: medium.absorption, plane_count: tables.planes.rows / 2,
      light_count: tables.lights.rows / 7, seed: [accuracy.seed % 2 ** 32, Math.floor(accuracy.seed / 2 ** 32)], max_depth: accuracy.max_depth ?? NO_DEPTH,
      late_depth: accuracy.max_depth === null ? LATE_DEPTH : NO_DEPTH, cutoff: accuracy.cutoff ?? 0, roulette: accuracy.cutoff === null ? ROULETTE : 0, has_alpha: header.output.alpha ? 1 : 0,
      cue: cue ? [cue.front, cue.back, cue.front_scale, cue.back_scale] : [0, 0, 1, 1], cue_color: cue?.color || [0, 0, 0], ...more,
    };
    const setters = /** @type {Record<number, (at: WebGLUniformLocation | null, values: any) => void>} */ ({
      [gl.FLOAT]: (at, v) => gl.uniform1fv(at, v), [gl.FLOAT_VEC2]: (at, v) => gl.uniform2fv(at, v), [gl.FLOAT_VEC3]: (at, v) => gl.uniform3fv(at, v),
      [gl.FLOAT_VEC4]: (at, v) => gl.uniform4fv(at, v), [gl.INT]: (at, v) => gl.uniform1iv(at, v), [gl.BOOL]: (at, v) => gl.uniform1iv(at, v),
      [gl.INT_VEC2]: (at, v) => gl.uniform2iv(at, v), [gl.UNSIGNED_INT]: (at, v) => gl.uniform1uiv(at, v), [gl.UNSIGNED_INT_VEC2]: (at, v) => gl.uniform2uiv(at, v),
    });
    let unit = 0;
    for (const {name, type, at} of this.uniformsOf(program)) {
      if (type in setters) {
        setters[type](at, [/** @type {Record<string, number | number[]>} */ (all)[name]].flat());
        continue;
      }
      gl.activeTexture(gl.TEXTURE0 + ++unit);  // the first one is for uploads
      gl.bindTexture(gl.TEXTURE_2D, name === 'camera_media' ? this.media : this.textures.get(name) || null);
      gl.uniform1i(at, unit);
    }
  }

  /** One pixel into a texture of its own. @param {WebGLTexture | null} texture */
  drawSingle(texture) {
    const {gl} = this;
    this.bind(texture);
    gl.viewport(0, 0, 1, 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Finds the media around the camera: once for each place of it. @param {Camera} camera */
  findMedia(camera) {
    this.use(camera, {mode: MEDIA});
    const {gl} = this, at = gl.getUniformLocation(/** @type {WebGLProgram} */ (this.program), 'camera_media');
    if (!at) return;  // there are none
    gl.uniform1i(at, 0);  // not what is drawn into
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.single);
    this.drawSingle(this.media);
  }

  /**
   * Adds a sample to the rows [first, first + rows) of each pixel, from the lower border on.
   * @param {Camera} camera @param {{index: number, points: number, share: number, first: number, rows: number}} sample index -1: centered
   */
  trace(camera, {index, points, share, first, rows}) {
    const {gl} = this;
    this.use(camera, {sample_index: index, light_points: points, share});
    this.bind(this.sums);
    gl.viewport(0, 0, this.width, this.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, first, this.width, rows);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
  }

  /** Shows the mean of the samples on the canvas. */
  show() {
    const {canvas, width, height} = this;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    this.draw(null);
  }

  /** @param {WebGLTexture | null} texture */
  draw(texture) {
    const {gl, live} = this, output = live?.header.output;
    gl.useProgram(this.display);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.sums);
    const at = (/** @type {string} */ name) => gl.getUniformLocation(this.display, name);
    gl.uniform1f(at('exposure'), 2 ** (output?.exposure ?? 0));
    gl.uniform1i(at('reinhard'), output?.overflow === 'reinhard' ? 1 : 0);
    this.bind(texture);
    gl.viewport(0, 0, this.width, this.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** The object that a pixel shows, counted from the upper left corner. @param {Camera} camera @param {number} x @param {number} y */
  pick(camera, x, y) {
    const {gl} = this, values = new Float32Array(4);
    this.use(camera, {mode: OBJECT, corner: [x, this.height - 1 - y]});
    this.drawSingle(this.single);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, values);
    const [object, distance, material, depth] = values, world = 1 / (this.live?.header.scale ?? 1);
    return object > 0 ? {object, material, distance: distance * world, depth: depth * world} : null;
  }

  /** The codes that show() displays, four a pixel, from the upper left corner on. */
  pixels() {
    const {gl, width, height} = this, rows = new Uint8ClampedArray(4 * width * height), flipped = new Uint8ClampedArray(rows.length);
    const codes = this.texture(gl.RGBA8, width, height, gl.RGBA, gl.UNSIGNED_BYTE, null);
    this.draw(codes);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, rows);
    gl.deleteTexture(codes);
    for (let y = 0; y < height; ++y) flipped.set(rows.subarray(4 * width * y, 4 * width * (y + 1)), 4 * width * (height - 1 - y));
    return flipped;
  }

  /** Pixels in which rays had no place and were left out. */
  overflows() {
    const {gl, width, height} = this, sums = new Float32Array(4 * width * height);
    this.bind(this.sums);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, sums);
    return sums.reduce((count, sum, i) => count + (i % 4 === 3 && sum % 1 > 0 ? 1 : 0), 0);
  }

  /** Frees all memory of the graphics processor. */
  close() { this.gl.getExtension('WEBGL_lose_context')?.loseContext(); }
}
