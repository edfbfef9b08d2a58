/** Distribution function of chi-square with three degrees of freedom. @param {number} x */
export function chi2of3(x) {
  if (x <= 0) return 0;
  const z = Math.sqrt(x / 2);
  return erf(z) - Math.sqrt((2 * x) / Math.PI) * Math.exp(-x / 2);
}

/** Error function: its series near zero, its continued fraction far out. @param {number} x */
export function erf(x) {
  if (x < 0) return -erf(-x);
  if (x < 2.5) {
    let term = x;
    let sum = x;
    for (let n = 1; n < 200; n++) {
      term *= (-x * x) / n;
      const add = term / (2 * n + 1);
      sum += add;
      if (Math.abs(add) < 1e-17 * Math.abs(sum)) break;
    }
    return (2 / Math.sqrt(Math.PI)) * sum;
  }
  let fraction = 0;
  for (let n = 60; n >= 1; n--) fraction = n / 2 / (x + fraction);
  return 1 - Math.exp(-x * x) / (Math.sqrt(Math.PI) * (x + fraction));
}

/**
 * By how much the sigma along each axis is multiplied for an ellipsoid that holds the point with this probability.
 * @param {number} confidence
 */
export function ellipsoidFactor(confidence) {
  let low = 0;
  let high = 200;
  for (let step = 0; step < 200; step++) {
    const middle = (low + high) / 2;
    if (chi2of3(middle) < confidence) low = middle;
    else high = middle;
  }
  return Math.sqrt((low + high) / 2);
}

/**
 * Counts of values in equal bins; what lies outside is in the first and last.
 * @param {ArrayLike<number | null>} values
 * @param {number} low @param {number} high @param {number} bins
 */
export function histogram(values, low, high, bins) {
  const counts = new Array(bins).fill(0);
  for (let i = 0; i < values.length; i++) {
    const value = values[i];
    if (value === null || !Number.isFinite(value)) continue;
    const bin = Math.floor(((value - low) / (high - low)) * bins);
    counts[Math.min(bins - 1, Math.max(0, bin))] += 1;
  }
  return counts;
}

/** The next of 1, 2, 5 times a power of ten that is not above x. @param {number} x */
export function roundDown(x) {
  if (!(x > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(x) + 1e-12);
  const lead = x / power + 1e-9;
  return (lead >= 5 ? 5 : lead >= 2 ? 2 : 1) * power;
}

/** Median of numbers; NaN of none. @param {number[]} values */
export function median(values) {
  const sorted = values.filter(Number.isFinite).sort((a, b) => a - b);
  if (!sorted.length) return NaN;
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}
