/** SHA-256 (FIPS 180-4). crypto.subtle exists only in secure contexts, and plain HTTP on a network is none. */

/** The first 32 bits of the fractional parts of a root of the first primes. @param {number} root @param {number} count */
function constants(root, count) {
  const found = [];
  for (let n = 2; found.length < count; ++n) {
    let prime = true;
    for (let d = 2; d * d <= n; ++d) prime &&= n % d !== 0;
    if (prime) found.push(((n ** (1 / root)) % 1) * 2 ** 32 | 0);
  }
  return found;
}

const K = constants(3, 64), H = constants(2, 8);

/** @param {number} x @param {number} n */
const rotate = (x, n) => (x >>> n) | (x << (32 - n));

/** @param {Int32Array} h state @param {Int32Array} w schedule; the first 16 words are the block */
function compress(h, w) {
  for (let t = 16; t < 64; ++t) {
    const s0 = rotate(w[t - 15], 7) ^ rotate(w[t - 15], 18) ^ (w[t - 15] >>> 3);
    const s1 = rotate(w[t - 2], 17) ^ rotate(w[t - 2], 19) ^ (w[t - 2] >>> 10);
    w[t] = w[t - 16] + s0 + w[t - 7] + s1;
  }
  let [a, b, c, d, e, f, g, last] = h;
  for (let t = 0; t < 64; ++t) {
    const t1 = last + (rotate(e, 6) ^ rotate(e, 11) ^ rotate(e, 25)) + ((e & f) ^ (~e & g)) + K[t] + w[t];
    const t2 = (rotate(a, 2) ^ rotate(a, 13) ^ rotate(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
    last = g; g = f; f = e; e = (d + t1) | 0; d = c; c = b; b = a; a = (t1 + t2) | 0;
  }
  [a, b, c, d, e, f, g, last].forEach((value, i) => { h[i] += value; });
}

/** @param {ArrayBuffer} bytes @returns {string} 64 hexadecimal digits */
export function plainSha256(bytes) {
  const blocks = Math.ceil((bytes.byteLength + 9) / 64);
  const padded = new Uint8Array(blocks * 64);
  padded.set(new Uint8Array(bytes));
  padded[bytes.byteLength] = 0x80;
  const view = new DataView(padded.buffer);
  view.setBigUint64(padded.length - 8, BigInt(bytes.byteLength) * 8n);
  const h = Int32Array.from(H), w = new Int32Array(64);
  for (let block = 0; block < blocks; ++block) {
    for (let t = 0; t < 16; ++t) w[t] = view.getInt32(block * 64 + t * 4);
    compress(h, w);
  }
  return [...h].map((word) => (word >>> 0).toString(16).padStart(8, '0')).join('');
}

/** @param {ArrayBuffer} bytes */
export async function sha256(bytes) {
  if (!globalThis.crypto?.subtle) return plainSha256(bytes);
  const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes));
  return [...digest].map((byte) => byte.toString(16).padStart(2, '0')).join('');
}
