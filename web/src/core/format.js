/** Numbers as a surveyor reads them. Inside are metres and radians; units are said here only. */

const ARCSEC = (180 * 3600) / Math.PI;
const MGON = 200000 / Math.PI;

const DASH = '–';
const thin = '\u202f';

/** @param {unknown} x @returns {x is number} */
const isNumber = (x) => typeof x === 'number' && Number.isFinite(x);

/** A count with groups of three digits. @param {number} n */
export function count(n) {
  return String(Math.round(n)).replace(/\B(?=(\d{3})+(?!\d))/g, thin);
}

/** A coordinate or length in metres. @param {unknown} x @param {number} digits */
export const metres = (x, digits = 4) => (isNumber(x) ? x.toFixed(digits) : DASH);

/** A small length in millimetres, without its unit. @param {unknown} x @param {number} digits */
export const millimetres = (x, digits = 2) => (isNumber(x) ? minusSign((x * 1000).toFixed(digits)) : DASH);

/** @param {unknown} x @param {number} digits */
export const plain = (x, digits = 2) => (isNumber(x) ? minusSign(x.toFixed(digits)) : DASH);

/** @param {string} text */
const minusSign = (text) => (/^-0\.?0*$/.test(text) ? text.slice(1) : text.replace('-', '\u2212'));

/**
 * The unit in which small values of a kind are shown, and how many of it are one metre or radian.
 * @param {string} unit "m" or "rad" or another, shown as it is
 * @param {string} angle "gon" or "deg"
 */
export function small(unit, angle) {
  if (unit === 'm') return { unit: 'mm', factor: 1000, digits: 2 };
  if (unit === 'rad') {
    return angle === 'gon' ? { unit: 'mgon', factor: MGON, digits: 2 } : { unit: '″', factor: ARCSEC, digits: 1 };
  }
  if (unit === 'm2') return { unit: 'mm²', factor: 1e6, digits: 2 };
  return { unit: unit && unit !== '1' ? unit : '', factor: 1, digits: 5 };
}

/** A small value with its unit. @param {unknown} x @param {string} unit @param {string} angle */
export function smallWords(x, unit, angle) {
  if (!isNumber(x)) return DASH;
  const how = small(unit, angle);
  const words = plain(x * how.factor, how.digits);
  return how.unit ? `${words}${how.unit === '″' ? '' : '\u00a0'}${how.unit}` : words;
}

/** An angle in degrees with one decimal. @param {unknown} x radians */
export const degrees = (x) => (isNumber(x) ? `${((x * 180) / Math.PI).toFixed(1)}°` : DASH);

/**
 * A number for a legend: as many digits as tell neighbouring ticks apart.
 * @param {number} x @param {number} step
 */
export function tick(x, step) {
  const digits = Math.max(0, Math.min(6, -Math.floor(Math.log10(Math.abs(step) || 1) + 1e-9)));
  return minusSign(x.toFixed(digits));
}

/**
 * Round places between two numbers, about `wanted` of them.
 * @param {number} low @param {number} high @param {number} wanted
 * @returns {{step: number, ticks: number[]}}
 */
export function ticks(low, high, wanted = 5) {
  const span = high - low;
  if (!(span > 0) || !Number.isFinite(span)) return { step: 1, ticks: [low] };
  const raw = span / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  const lead = raw / power;
  const step = (lead > 5 ? 10 : lead > 2 ? 5 : lead > 1 ? 2 : 1) * power;
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * span; k++) out.push(k * step);
  return { step, ticks: out };
}

/** "target_centre" as a person writes it. @param {string} word */
export const spaced = (word) => String(word ?? '').replaceAll('_', ' ');
