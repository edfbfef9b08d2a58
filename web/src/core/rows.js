/**
 * The table of observations: which rows are shown, and in which order. Columns are arrays of one length; a row is its index.
 * @typedef {Record<string, any[]>} Columns
 * @typedef {{text: string, station: string, kind: string, state: string, low: number | null, high: number | null}} Filter
 */

export const NO_FILTER = Object.freeze({ text: '', station: '', kind: '', state: '', low: null, high: null });

/** @param {Columns} columns */
export const size = (columns) => columns.id?.length ?? 0;

/**
 * Rows that pass the filter. Words of the text must all occur in names, kind, source or reason.
 * @param {Columns} columns @param {Filter} filter
 * @returns {Int32Array}
 */
export function filtered(columns, filter) {
  const n = size(columns);
  const out = new Int32Array(n);
  const words = filter.text.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  for (let i = 0; i < n; i++) {
    if (filter.station && columns.from[i] !== filter.station && columns.to[i] !== filter.station) continue;
    if (filter.kind && columns.kind[i] !== filter.kind) continue;
    if (filter.state === 'suspicious') {
      if (!columns.suspicious[i]) continue;
    } else if (filter.state && columns.state[i] !== filter.state) continue;
    if (filter.low !== null || filter.high !== null) {
      const w = columns.w[i];
      if (w === null || w === undefined) continue;
      if (filter.low !== null && w < filter.low) continue;
      if (filter.high !== null && w > filter.high) continue;
    }
    if (words.length) {
      const text = `${columns.from[i]} ${columns.to[i]} ${columns.kind[i]} ${columns.component?.[i] ?? ''} ${
        columns.source?.[i] ?? ''
      } ${columns.reason?.[i] ?? ''} ${columns.id[i]}`.toLowerCase();
      if (!words.every((word) => text.includes(word))) continue;
    }
    out[count++] = i;
  }
  return out.subarray(0, count);
}

/** Columns that are sorted by their size, whatever their sign. */
const BY_SIZE = new Set(['w', 'residual', 'tau']);

/**
 * The rows in the order of a column; rows without a value come last, equal ones keep the order of the file.
 * @param {Columns} columns @param {Int32Array} rows @param {string} by @param {boolean} down
 */
export function sorted(columns, rows, by, down) {
  const values = columns[by];
  if (!values) return rows;
  const out = Array.from(rows);
  const missing = (/** @type {any} */ x) => x === null || x === undefined || Number.isNaN(x);
  const key = BY_SIZE.has(by) ? (/** @type {any} */ x) => (missing(x) ? x : Math.abs(x)) : (/** @type {any} */ x) => x;
  const sign = down ? -1 : 1;
  out.sort((i, j) => {
    const [a, b] = [key(values[i]), key(values[j])];
    if (missing(a) || missing(b)) return missing(a) && missing(b) ? i - j : missing(a) ? 1 : -1;
    if (typeof a === 'string') return sign * a.localeCompare(b, 'en', { numeric: true }) || i - j;
    return sign * (Number(a) - Number(b)) || i - j;
  });
  return Int32Array.from(out);
}

/**
 * Which rows of a long list stand in the window, with some to spare above and below.
 * @param {number} top pixels scrolled @param {number} height of the window @param {number} row height @param {number} n rows
 */
export function inWindow(top, height, row, n) {
  const spare = 8;
  const first = Math.max(0, Math.floor(top / row) - spare);
  const last = Math.min(n, Math.ceil((top + height) / row) + spare);
  return { first: Math.min(first, last), last };
}

/** Values that occur in a column, in order. @param {any[]} column */
export function distinct(column) {
  return [...new Set(column.filter((x) => x !== '' && x !== null && x !== undefined))].sort((a, b) =>
    String(a).localeCompare(String(b), 'en', { numeric: true }),
  );
}

/**
 * Columns in as many lines as a table of this width needs: none is cut, none is left out. In the first line `wide` takes what is
 * left, in its own line `last` does. Further lines stand in by the width of the first column.
 * @param {[string, string, number][]} columns name, title and pixels @param {number} room pixels
 * @param {string} wide @param {string} last
 * @returns {{lines: {name: string, width: number}[][], width: number}}
 */
export function laidOut(columns, room, wide, last) {
  const indent = columns[0][2];
  const width = Math.max(room, indent + Math.max(...columns.map(([, , w]) => w)));
  /** @type {{name: string, width: number}[][]} */
  const lines = [];
  let left = -1;
  for (const [name, , w] of columns) {
    if (w > left) {
      if (lines.length === 1) grow(lines[0], wide, left);
      left = lines.length ? width - indent : width;
      lines.push([]);
    }
    lines[lines.length - 1].push({ name, width: w });
    left -= w;
  }
  grow(lines[lines.length - 1], last, left);
  return { lines, width };
}

/** @param {{name: string, width: number}[]} line @param {string} name @param {number} by */
function grow(line, name, by) {
  const it = line.find((column) => column.name === name);
  if (it) it.width += by;
}
