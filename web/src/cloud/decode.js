/**
 * Records of LAS 1.4 as columns for drawing: float32 about the centre of the node, and the attributes beside them.
 * @typedef {{
 *   format: number, recordLength: number, scale: number[], offset: number[],
 *   extra: {name: string, at: number, type: string, scale: number, offset: number}[]
 * }} Layout
 */

const READ = {
  int8: (d, i) => d.getInt8(i), uint8: (d, i) => d.getUint8(i),
  int16: (d, i) => d.getInt16(i, true), uint16: (d, i) => d.getUint16(i, true),
  int32: (d, i) => d.getInt32(i, true), uint32: (d, i) => d.getUint32(i, true),
  float32: (d, i) => d.getFloat32(i, true), float64: (d, i) => d.getFloat64(i, true),
};

const WIDTH = { 6: 30, 7: 36, 8: 38 };
const COLOUR_AT = { 7: 30, 8: 30 };

/**
 * Where the extra dimensions of a file stand in its records.
 * @param {{pointDataRecordFormat: number, pointDataRecordLength: number, scale: number[], offset: number[]}} header
 * @param {{name: string, type?: string, length: number, scale?: number, offset?: number}[]} extra
 * @returns {Layout}
 */
export function layout(header, extra) {
  const format = header.pointDataRecordFormat;
  let at = WIDTH[format];
  if (at === undefined) throw new Error(`point format ${format} is not one of COPC (6, 7, 8)`);
  const out = [];
  for (const dimension of extra) {
    const kind = { signed: 'int', unsigned: 'uint', float: 'float' }[dimension.type ?? ''];
    const type = `${kind}${dimension.length * 8}`;
    if (READ[type]) {
      out.push({ name: dimension.name, at, type, scale: dimension.scale ?? 1, offset: dimension.offset ?? 0 });
    }
    at += dimension.length;
  }
  return {
    format, recordLength: header.pointDataRecordLength,
    scale: [...header.scale], offset: [...header.offset], extra: out,
  };
}

/**
 * @param {Layout} how
 * @param {number[]} centre of the node, in the file's coordinates
 * @param {number} count
 */
export function columns(how, centre, count) {
  const extra = new Map(how.extra.map((dimension) => [dimension.name, dimension]));
  const sigmas = ['sigma_x', 'sigma_y', 'sigma_z'].map((name) => extra.get(name));
  const incidence = extra.get('incidence');
  const distance = extra.get('distance');
  const level = distance ? extra.get('lod95') : null;
  const colourAt = COLOUR_AT[how.format];
  const out = {
    position: new Float32Array(3 * count),
    intensity: new Uint16Array(count),
    sigma: sigmas.every(Boolean) ? new Float32Array(3 * count) : null,
    incidence: incidence ? new Uint16Array(count) : null,
    distance: distance ? new Float32Array(count) : null,
    level: level ? new Float32Array(count) : null,
    rgb: colourAt === undefined ? null : new Uint8Array(3 * count),
  };
  const shift = [0, 1, 2].map((k) => how.offset[k] - centre[k]);
  const get = (view, base, dimension) => READ[dimension.type](view, base + dimension.at) * dimension.scale + dimension.offset;
  let bright = false;
  /** @param {DataView} view @param {number} base start of the record @param {number} i of the point */
  function take(view, base, i) {
    for (let k = 0; k < 3; k++) {
      out.position[3 * i + k] = view.getInt32(base + 4 * k, true) * how.scale[k] + shift[k];
    }
    out.intensity[i] = view.getUint16(base + 12, true);
    if (out.sigma) for (let k = 0; k < 3; k++) out.sigma[3 * i + k] = get(view, base, sigmas[k]);
    // hundredths of a degree in 16 bits
    if (out.incidence) out.incidence[i] = Math.min(65535, Math.max(0, Math.round(get(view, base, incidence) * 100)));
    if (out.distance) out.distance[i] = get(view, base, distance);
    if (out.level) out.level[i] = get(view, base, level);
    if (out.rgb) {
      for (let k = 0; k < 3; k++) {
        const value = view.getUint16(base + colourAt + 2 * k, true);
        if (value > 255) bright = true;
        out.rgb[3 * i + k] = value >> 8;
      }
    }
  }
  /** Colours of eight bits in fields of sixteen are met in the field. @param {(i: number) => number} base @param {DataView} view */
  function finish(view, base) {
    if (!out.rgb || bright) return;
    for (let i = 0; i < count; i++) {
      for (let k = 0; k < 3; k++) out.rgb[3 * i + k] = view.getUint16(base(i) + colourAt + 2 * k, true);
    }
  }
  return { out, take, finish };
}

/** @param {Layout} how @param {Uint8Array} records @param {number[]} centre @param {number} count */
export function decoded(how, records, centre, count) {
  const view = new DataView(records.buffer, records.byteOffset, records.byteLength);
  const { out, take, finish } = columns(how, centre, count);
  for (let i = 0; i < count; i++) take(view, i * how.recordLength, i);
  finish(view, (i) => i * how.recordLength);
  return out;
}
