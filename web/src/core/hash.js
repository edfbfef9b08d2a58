/**
 * The view in the address: what is read from there is not trusted, and what does not fit is left out.
 * @typedef {{
 *   camera?: {eye: number[], yaw: number, pitch: number, ortho: boolean, height: number},
 *   colour?: string, range?: [number, number] | null, hidden?: string[], select?: string, size?: number, edl?: number,
 *   ellipsoids?: number, moves?: number, slice?: {on: boolean, centre: number[], half: number[], turn: number} | null,
 *   tab?: string, sort?: string, down?: boolean, text?: string, station?: string, kind?: string, state?: string, theme?: string
 * }} View
 */

const numbers = (/** @type {number[]} */ list, digits = 3) => list.map((x) => Number(x.toFixed(digits))).join(',');

/** @param {string | null} text @param {number} n @returns {number[] | null} */
function read(text, n) {
  if (!text) return null;
  const list = text.split(',').map(Number);
  return list.length === n && list.every(Number.isFinite) ? list : null;
}

const WORDS = ['colour', 'tab', 'sort', 'text', 'station', 'kind', 'state', 'theme', 'select'];
const NUMBERS = ['size', 'edl', 'ellipsoids', 'moves'];

/** @param {View} view @returns {string} without the # */
export function written(view) {
  const out = new URLSearchParams();
  if (view.camera) {
    const c = view.camera;
    out.set('camera', numbers([...c.eye, c.yaw, c.pitch, c.height], 4));
    if (c.ortho) out.set('ortho', '1');
  }
  for (const key of WORDS) if (view[key]) out.set(key, view[key]);
  for (const key of NUMBERS) if (view[key] !== undefined && view[key] !== null) out.set(key, String(view[key]));
  if (view.range) out.set('range', view.range.map((x) => Number(x.toPrecision(6))).join(','));
  if (view.hidden) for (const name of view.hidden) out.append('hide', name);
  if (view.slice?.on) out.set('slice', numbers([...view.slice.centre, ...view.slice.half, view.slice.turn], 4));
  if (view.down !== undefined) out.set('down', view.down ? '1' : '0');
  return out.toString();
}

/** @param {string} hash with or without # @returns {View} */
export function parsed(hash) {
  const from = new URLSearchParams(hash.replace(/^#/, ''));
  /** @type {View} */
  const view = {};
  const camera = read(from.get('camera'), 6);
  if (camera && camera[5] > 0) {
    view.camera = { eye: camera.slice(0, 3), yaw: camera[3], pitch: camera[4], height: camera[5], ortho: from.get('ortho') === '1' };
  }
  for (const key of WORDS) {
    const word = from.get(key);
    if (word) view[key] = word.slice(0, 400);
  }
  for (const key of NUMBERS) {
    const number = Number(from.get(key) ?? NaN);
    if (from.has(key) && Number.isFinite(number) && number >= 0) view[key] = number;
  }
  const range = read(from.get('range'), 2);
  if (range && range[0] < range[1]) view.range = [range[0], range[1]];
  if (from.has('hide')) view.hidden = from.getAll('hide').slice(0, 2000);
  const slice = read(from.get('slice'), 7);
  if (slice && slice.slice(3, 6).every((x) => x > 0)) {
    view.slice = { on: true, centre: slice.slice(0, 3), half: slice.slice(3, 6), turn: slice[6] };
  }
  if (from.has('down')) view.down = from.get('down') === '1';
  return view;
}
