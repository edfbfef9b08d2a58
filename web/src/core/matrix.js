/**
 * Small matrices in double precision: plain arrays, row by row.
 * @typedef {[number, number, number]} Vec3
 * @typedef {[Vec3, Vec3, Vec3]} Mat3
 */

/** @param {Mat3} m @param {Vec3} v @returns {Vec3} */
export function times(m, v) {
  return [
    m[0][0] * v[0] + m[0][1] * v[1] + m[0][2] * v[2],
    m[1][0] * v[0] + m[1][1] * v[1] + m[1][2] * v[2],
    m[2][0] * v[0] + m[2][1] * v[1] + m[2][2] * v[2],
  ];
}

/** @param {Mat3} a @param {Mat3} b @returns {Mat3} */
export function product(a, b) {
  const out = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  for (let i = 0; i < 3; i++)
    for (let j = 0; j < 3; j++) out[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  return /** @type {Mat3} */ (out);
}

/** @param {Mat3} m @returns {Mat3} */
export function transposed(m) {
  return [
    [m[0][0], m[1][0], m[2][0]],
    [m[0][1], m[1][1], m[2][1]],
    [m[0][2], m[1][2], m[2][2]],
  ];
}

/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/** @param {Vec3} v */
export const length = (v) => Math.hypot(v[0], v[1], v[2]);

/** A matrix turned by `r`: r m r'. @param {Mat3} r @param {Mat3} m @returns {Mat3} */
export const turned = (r, m) => product(product(r, m), transposed(r));

/**
 * Eigenvalues (largest first) and eigenvectors (columns) of a symmetric matrix, by Jacobi's rotations.
 * @param {Mat3} matrix
 * @returns {{values: Vec3, vectors: Mat3}}
 */
export function eigen(matrix) {
  const a = matrix.map((row) => [...row]);
  const v = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (let sweep = 0; sweep < 40; sweep++) {
    const off = a[0][1] ** 2 + a[0][2] ** 2 + a[1][2] ** 2;
    const size = a[0][0] ** 2 + a[1][1] ** 2 + a[2][2] ** 2;
    if (off <= 1e-30 * size || off === 0) break;
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (a[p][q] === 0) continue;
      const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const t = (theta >= 0 ? 1 : -1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
      const c = 1 / Math.sqrt(t * t + 1);
      const s = t * c;
      for (let k = 0; k < 3; k++) {
        const [x, y] = [a[k][p], a[k][q]];
        a[k][p] = c * x - s * y;
        a[k][q] = s * x + c * y;
      }
      for (let k = 0; k < 3; k++) {
        const [x, y] = [a[p][k], a[q][k]];
        a[p][k] = c * x - s * y;
        a[q][k] = s * x + c * y;
      }
      for (let k = 0; k < 3; k++) {
        const [x, y] = [v[k][p], v[k][q]];
        v[k][p] = c * x - s * y;
        v[k][q] = s * x + c * y;
      }
    }
  }
  const order = [0, 1, 2].sort((i, j) => a[j][j] - a[i][i]);
  return {
    values: /** @type {Vec3} */ (order.map((i) => a[i][i])),
    vectors: /** @type {Mat3} */ (v.map((row) => order.map((i) => row[i]))),
  };
}

/**
 * The rotation (3x3) and shift of a 4x4 pose.
 * @param {number[][]} pose
 */
export function parts(pose) {
  return {
    turn: /** @type {Mat3} */ ([pose[0].slice(0, 3), pose[1].slice(0, 3), pose[2].slice(0, 3)]),
    shift: /** @type {Vec3} */ ([pose[0][3], pose[1][3], pose[2][3]]),
  };
}

/**
 * What carries a cloud from its pose of old to the new one, in the axes and about the origin of the drawing.
 * @param {number[][]} before world_from_scanner that the cloud was written with
 * @param {number[][]} now world_from_scanner of this state
 * @param {Mat3} frame work axes to drawing axes
 * @param {Vec3} origin work frame, metres
 * @returns {{turn: Mat3, shift: Vec3}}
 */
export function carried(before, now, frame, origin) {
  const old = parts(before);
  const fresh = parts(now);
  const turn = product(fresh.turn, transposed(old.turn));
  // (turn o + t) - o, from differences that are small however far the origin is
  const arm = minus(origin, old.shift);
  const swung = minus(times(turn, arm), arm);
  const step = minus(fresh.shift, old.shift);
  return {
    turn: product(product(frame, turn), transposed(frame)),
    shift: times(frame, [swung[0] + step[0], swung[1] + step[1], swung[2] + step[2]]),
  };
}

/**
 * Covariance of the difference of two places.
 * @param {ArrayLike<number>} joint lower triangle of the covariance of all places, row by row, three rows each
 * @param {number} a @param {number} b numbers of the places
 */
export function ofDifference(joint, a, b) {
  const at = (/** @type {number} */ i, /** @type {number} */ k) => (i < k ? joint[(k * (k + 1)) / 2 + i] : joint[(i * (i + 1)) / 2 + k]);
  return [0, 1, 2].map((i) => [0, 1, 2].map((k) => at(3 * a + i, 3 * a + k) + at(3 * b + i, 3 * b + k) - at(3 * a + i, 3 * b + k) - at(3 * b + i, 3 * a + k)));
}
