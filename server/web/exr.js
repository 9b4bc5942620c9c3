/**
 * Reads the channels of the scan-line OpenEXR files that Whittle writes: 16 or 32 bit floats or 32 bit integers, uncompressed or ZIP.
 * "OpenEXR File Layout" (Academy Software Foundation); the order of bytes is undone as in ImfZip.cpp. Bytes are not trusted.
 */

/** @typedef {{width: number, height: number, channels: Record<string, Float32Array>}} Exr */

const MAGIC = 20000630, TILED_OR_DEEP = 0x1a00, SIDE_MAX = 32768, VALUES_MAX = 64e6, LINES_OF = /** @type {Record<number, number>} */ ({0: 1, 2: 1, 3: 16});
const BYTES_OF = [4, 2, 4];  // of uint, half, float

class Reader {
  /** @param {ArrayBuffer} bytes */
  constructor(bytes) { this.view = new DataView(bytes); this.at = 0; }
  /** @param {number} count */
  skip(count) {
    const begin = this.at;
    if (count < 0 || begin + count > this.view.byteLength) throw new Error('the EXR file ends too early');
    this.at += count;
    return begin;
  }
  int() { return this.view.getInt32(this.skip(4), true); }
  text() {
    for (let text = ''; ;) {
      const code = this.view.getUint8(this.skip(1));
      if (code === 0) return text;
      if (text.length > 255) throw new Error('the EXR file has a name without an end');
      text += String.fromCharCode(code);
    }
  }
}

/** @param {Reader} reader */
function readHeader(reader) {
  if (reader.int() !== MAGIC) throw new Error('this is no EXR file');
  if (reader.int() & TILED_OR_DEEP) throw new Error('tiled, deep and multi-part EXR files are not read');
  /** @type {{name: string, type: number}[]} */
  const channels = [];
  let compression = -1;
  /** @type {number[] | undefined} */
  let box;
  for (let name = reader.text(); name !== ''; name = reader.text()) {
    reader.text();
    const size = reader.int(), begin = reader.skip(size), part = new Reader(reader.view.buffer.slice(begin, begin + size));
    if (name === 'compression') compression = part.view.getUint8(part.skip(1));
    if (name === 'dataWindow') box = [part.int(), part.int(), part.int(), part.int()];
    if (name !== 'channels') continue;
    for (let channel = part.text(); channel !== ''; channel = part.text()) {
      const type = part.int();
      part.skip(4);
      if (part.int() !== 1 || part.int() !== 1 || !BYTES_OF[type]) throw new Error('the EXR file has channels of another kind');
      channels.push({name: channel, type});
    }
  }
  if (!box || channels.length === 0 || !LINES_OF[compression]) throw new Error('the EXR file has another compression than ZIP');
  const width = box[2] - box[0] + 1, height = box[3] - box[1] + 1;
  if (width < 1 || height < 1 || width > SIDE_MAX || height > SIDE_MAX || width * height * channels.length > VALUES_MAX) {
    throw new Error(`the EXR file is too large: ${width} x ${height}, ${channels.length} channels`);
  }
  return {channels, compression, top: box[1], width, height};
}

/** @param {Uint8Array<ArrayBuffer>} bytes @param {number} size expected @returns {Promise<Uint8Array<ArrayBuffer>>} */
async function inflate(bytes, size) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate')).getReader();
  const out = new Uint8Array(size);
  for (let at = 0; ;) {
    const {done, value} = await stream.read();
    if (done) {
      if (at !== size) throw new Error('a block of the EXR file is too short');
      return out;
    }
    if (at + value.length > size) {
      stream.cancel();
      throw new Error('a block of the EXR file is too long');
    }
    out.set(value, at);
    at += value.length;
  }
}

/** Undoes the differences, then the separation of even and odd bytes. @param {Uint8Array<ArrayBuffer>} bytes */
function unpredict(bytes) {
  for (let i = 1; i < bytes.length; ++i) bytes[i] = bytes[i - 1] + bytes[i] - 128;
  const out = new Uint8Array(bytes.length), half = (bytes.length + 1) >> 1;
  for (let i = 0; i < bytes.length; ++i) out[i] = bytes[i & 1 ? half + (i >> 1) : i >> 1];
  return out;
}

/** IEEE 754 binary16. @param {number} bits */
function halfValue(bits) {
  const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
  if (exponent === 0) return sign * fraction * 2 ** -24;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}

/** @param {ArrayBuffer} bytes @param {string[]} [wanted] names of channels; by default all @returns {Promise<Exr>} */
export async function readExr(bytes, wanted) {
  const reader = new Reader(bytes);
  const {channels, compression, top, width, height} = readHeader(reader);
  const lines = LINES_OF[compression], blocks = Math.ceil(height / lines);
  reader.skip(8 * blocks);  // the table of offsets; blocks follow in any order, each with its line
  const row = channels.reduce((sum, {type}) => sum + BYTES_OF[type] * width, 0);
  /** @type {Record<string, Float32Array>} */
  const found = {};
  for (const {name} of channels) if (!wanted || wanted.includes(name)) found[name] = new Float32Array(width * height);
  for (let block = 0; block < blocks; ++block) {
    const y = reader.int() - top, size = reader.int(), begin = reader.skip(size);
    if (y < 0 || y >= height || y % lines !== 0) throw new Error('a block of the EXR file is outside of the image');
    const count = Math.min(lines, height - y), packed = new Uint8Array(bytes, begin, size);
    if (size > row * count) throw new Error('a block of the EXR file is too long');
    const plain = size === row * count ? packed.slice() : unpredict(await inflate(packed, row * count));
    place(new DataView(plain.buffer), channels, found, width, y, count);
  }
  return {width, height, channels: found};
}

/** @param {DataView} view @param {{name: string, type: number}[]} channels @param {Record<string, Float32Array>} found @param {number} width @param {number} y @param {number} count */
function place(view, channels, found, width, y, count) {
  let at = 0;
  for (let line = y; line < y + count; ++line) {
    for (const {name, type} of channels) {
      const into = found[name], size = BYTES_OF[type];
      for (let x = 0; into && x < width; ++x) {
        const from = at + x * size;
        into[line * width + x] = type === 2 ? view.getFloat32(from, true) : type === 1 ? halfValue(view.getUint16(from, true)) : view.getUint32(from, true);
      }
      at += size * width;
    }
  }
}

// ---- as images that a browser shows

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
