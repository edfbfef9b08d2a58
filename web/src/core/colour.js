/** Colours of values. Each scale is a list of stops that are evenly spaced; all are legible to the colour blind. */

/** @param {string} hex @returns {[number, number, number]} 0 to 255 */
export function rgb(hex) {
  const n = parseInt(hex.slice(1), 16);
  return [(n >> 16) & 255, (n >> 8) & 255, n & 255];
}

export const SCALES = {
  // dark and blue is small, light and yellow is large
  viridis: ['#440154', '#482878', '#3e4989', '#31688e', '#26828e', '#1f9e89', '#35b779', '#6ece58', '#b5de2b', '#fde725'],
  slate: ['#10161d', '#2d3a46', '#566775', '#8d9aa3', '#c4cac9', '#f4f1e6'],
  ember: ['#1d1147', '#51127c', '#8c2981', '#c83e73', '#f1605d', '#fe9f6d', '#fcd9a0'],
  // from one side over nothing to the other
  balance: ['#2166ac', '#67a9cf', '#d1e5f0', '#f2f0ec', '#fddbc7', '#ef8a62', '#b2182b'],
};

/** Which scale an attribute is drawn with. @param {string} attribute */
export function scaleOf(attribute) {
  if (attribute === 'intensity') return 'slate';
  if (attribute === 'incidence') return 'ember';
  if (attribute === 'distance' || attribute === 'significance') return 'balance';
  return 'viridis';
}

/** Colours of stations, told apart by the colour blind (after Okabe and Ito). */
export const STATIONS = ['#0072b2', '#e69f00', '#009e73', '#cc79a7', '#56b4e9', '#d55e00', '#b8a800', '#7a5195', '#8c8c8c'];

/** @param {string[]} stops @param {number} t 0 to 1 @returns {[number, number, number]} */
export function along(stops, t) {
  const x = Math.min(1, Math.max(0, t)) * (stops.length - 1);
  const i = Math.min(stops.length - 2, Math.floor(x));
  const [a, b] = [rgb(stops[i]), rgb(stops[i + 1])];
  const f = x - i;
  return [a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]), a[2] + f * (b[2] - a[2])];
}

/** A scale as 256 colours with four bytes each. @param {string} name */
export function table(name) {
  const out = new Uint8Array(1024);
  for (let i = 0; i < 256; i++) out.set([...along(SCALES[name], i / 255).map(Math.round), 255], 4 * i);
  return out;
}

/**
 * Colour of a line by the largest |w| of its observations: quiet up to 2, amber from there, red where a test failed.
 * @param {number | null} w @param {boolean} suspicious @param {boolean} dark
 * @returns {[number, number, number]} 0 to 1
 */
export function ofTest(w, suspicious, dark) {
  if (suspicious) return [0.86, 0.13, 0.15];
  const quiet = dark ? [0.56, 0.63, 0.7] : [0.36, 0.43, 0.5];
  const warm = [0.93, 0.58, 0.08];
  const t = Math.min(1, Math.max(0, (Math.abs(w ?? 0) - 1.5) / 1.5));
  return /** @type {[number, number, number]} */ (quiet.map((q, i) => q + t * (warm[i] - q)));
}
