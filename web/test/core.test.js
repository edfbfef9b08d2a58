import assert from 'node:assert/strict';
import { test } from 'node:test';
import { along, ofTest, rgb, SCALES, table } from '../src/core/colour.js';
import { count, millimetres, plain, small, smallWords, tick, ticks } from '../src/core/format.js';
import { parsed, written } from '../src/core/hash.js';
import { carried, eigen, length, ofDifference, product, times, transposed, turned } from '../src/core/matrix.js';
import { distinct, filtered, inWindow, laidOut, NO_FILTER, sorted } from '../src/core/rows.js';
import { chi2of3, ellipsoidFactor, erf, histogram, median, roundDown } from '../src/core/statistics.js';

const near = (a, b, tolerance = 1e-12) => assert.ok(Math.abs(a - b) <= tolerance, `${a} is not ${b}`);

/** Turn about an axis by Rodrigues' formula. */
function turn(axis, angle) {
  const n = length(axis);
  const [x, y, z] = axis.map((v) => v / n);
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return [
    [c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
    [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
    [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)],
  ];
}

test('axes of an ellipsoid are those that it was made of', () => {
  const r = turn([1, 2, -3], 0.83);
  const { values, vectors } = eigen(turned(r, [[4, 0, 0], [0, 9, 0], [0, 0, 1]]));
  [9, 4, 1].forEach((v, i) => near(values[i], v, 1e-12));
  const back = product(product(vectors, [[9, 0, 0], [0, 4, 0], [0, 0, 1]]), transposed(vectors));
  const whole = turned(r, [[4, 0, 0], [0, 9, 0], [0, 0, 1]]);
  for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) near(back[i][j], whole[i][j], 1e-12);
});

test('a matrix without size has axes all the same', () => {
  assert.deepEqual(eigen([[0, 0, 0], [0, 0, 0], [0, 0, 0]]).values, [0, 0, 0]);
});

test('a small matrix keeps its digits', () => {
  const { values } = eigen([[1e-12, 0, 0], [0, 4e-12, 0], [0, 0, 2.5e-13]]);
  [4e-12, 1e-12, 2.5e-13].forEach((v, i) => near(values[i] / v, 1, 1e-12));
});

test('a cloud is carried from pose to pose, far from the origin of the world too', () => {
  const pose = (r, t) => r.map((row, i) => [...row, t[i]]).concat([[0, 0, 0, 1]]);
  const frame = turn([1, 1, 0.3], 1.1);
  const origin = [4100000, 700000, 4800000];
  const r0 = turn([0, 0, 1], 0.4);
  const r1 = product(turn([0.2, -0.1, 1], 2e-5), r0);
  const t0 = [4100012.3, 699990.2, 4800004.4];
  const t1 = [t0[0] + 0.0123, t0[1] - 0.0045, t0[2] + 0.0007];
  const { turn: d, shift } = carried(pose(r0, t0), pose(r1, t1), frame, origin);
  const scanner = [21.5, -8.25, 3.125];
  const world = (r, t) => times(r, scanner).map((x, i) => x + (t[i] - origin[i]));
  const before = times(frame, world(r0, t0));
  const after = times(frame, world(r1, t1));
  const got = times(d, before).map((x, i) => x + shift[i]);
  got.forEach((x, i) => near(x, after[i], 1e-8));
});

test('the factor of ellipsoids is the root of chi-square of three', () => {
  // tables: chi-square, 3 degrees of freedom, 0.95 is 7.8147; 0.99 is 11.3449; 0.5 is 2.3660
  near(ellipsoidFactor(0.95) ** 2, 7.8147, 1e-4);
  near(ellipsoidFactor(0.99) ** 2, 11.3449, 1e-4);
  near(ellipsoidFactor(0.5) ** 2, 2.366, 1e-4);
  near(chi2of3(7.814727903251179), 0.95, 1e-12);
});

test('the error function', () => {
  // tables of erf
  near(erf(0.5), 0.5204998778130465, 1e-14);
  near(erf(1), 0.8427007929497149, 1e-14);
  near(erf(3), 0.9999779095030014, 1e-14);
  near(erf(-1), -0.8427007929497149, 1e-14);
  near(erf(2.4999999), erf(2.5000001), 1e-8);
});

test('bins take every value once', () => {
  const values = [-9, -1, 0, 0.5, 0.999, 1, 9, null, NaN];
  assert.equal(histogram(values, -1, 1, 4).reduce((a, b) => a + b), 7);
});

test('median and round numbers', () => {
  assert.equal(median([3, 1, 2]), 2);
  assert.equal(median([4, 1, 2, 3]), 2.5);
  assert.ok(Number.isNaN(median([])));
  assert.equal(roundDown(612), 500);
  assert.equal(roundDown(1999), 1000);
  assert.equal(roundDown(0.0021), 0.002);
  assert.equal(roundDown(1000), 1000);
});

test('numbers are said in field units', () => {
  assert.equal(smallWords(0.00123, 'm', 'gon'), '1.23\u00a0mm');
  assert.equal(smallWords((0.001 * Math.PI) / 200, 'rad', 'gon'), '1.00\u00a0mgon');
  assert.equal(smallWords(Math.PI / 180 / 3600, 'rad', 'deg'), '1.0″');
  assert.equal(smallWords(null, 'm', 'gon'), '–');
  assert.equal(small('m', 'gon').unit, 'mm');
  assert.equal(millimetres(-0.000001), '0.00');
  assert.equal(plain(-1.5, 1), '\u22121.5');
  assert.equal(count(1234567), '1\u202f234\u202f567');
  assert.equal(count(999), '999');
});

test('ticks are round, inside, and told apart', () => {
  for (const [low, high] of [[2.482, 4.524], [0, 1], [-3, 17], [0.00012, 0.00013], [5, 5]]) {
    const { step, ticks: places } = ticks(low, high, 5);
    assert.ok(places.length >= 1 && places.length <= 12);
    for (const x of places) assert.ok(x >= low - 1e-9 && x <= high + 1e-9);
    if (places.length > 1 && step >= 1e-6) assert.equal(new Set(places.map((x) => tick(x, step))).size, places.length);
  }
});

test('colours begin and end where the scale does', () => {
  for (const [name, stops] of Object.entries(SCALES)) {
    assert.deepEqual(along(stops, 0), rgb(stops[0]));
    assert.deepEqual(along(stops, 1), rgb(stops.at(-1)));
    assert.deepEqual(along(stops, 7), rgb(stops.at(-1)));
    assert.equal(table(name).length, 1024);
  }
  assert.deepEqual(ofTest(9, true, false), ofTest(0, true, true));
});

test('the view survives the address', () => {
  const view = {
    camera: { eye: [1.5, -20, 3], yaw: 0.5, pitch: -0.25, ortho: true, height: 33 },
    colour: 'sigma_z', range: [0.001, 0.005], hidden: ['rays', 'scan:S 1&2'], size: 2.5, edl: 0, ellipsoids: 500,
    slice: { on: true, centre: [1, 2, 3], half: [4, 5, 6], turn: 0.125 }, tab: 'points', sort: 'mdb', down: false,
    text: 'E3 <b>', station: 'S1', kind: '', state: 'off', theme: 'dark', select: 'point:E#3',
  };
  const back = parsed(`#${written(view)}`);
  for (const [key, value] of Object.entries(view)) if (value !== '') assert.deepEqual(back[key], value, key);
});

test('an address that makes no sense is left out', () => {
  assert.deepEqual(parsed('#camera=1,2&range=5,1&size=x&slice=1,2,3,4,5,-1,0&edl=-3'), {});
  assert.deepEqual(parsed('#camera=NaN,1,1,1,1,1'), {});
  assert.deepEqual(parsed('%%%'), {});
});

const columns = {
  id: ['a', 'b', 'c', 'd'], kind: ['direction', 'zenith', 'direction', 'coordinates'], component: ['', '', '', 'E'],
  from: ['S10', 'S2', 'S2', 'A'], to: ['P1', 'P2', 'S10', ''], w: [-3.5, 1, null, 2], source: ['f.gsi:1', 'f.gsi:2', 'f.gsi:3', 'c.csv:1'],
  state: ['active', 'active', 'off', 'check'], suspicious: [true, false, false, false], reason: ['', '', 'Prism tilted', ''],
};
const kept = (change) => [...filtered(columns, { ...NO_FILTER, ...change })];

test('filters', () => {
  assert.deepEqual(kept({}), [0, 1, 2, 3]);
  assert.deepEqual(kept({ station: 'S10' }), [0, 2]);
  assert.deepEqual(kept({ kind: 'direction' }), [0, 2]);
  assert.deepEqual(kept({ state: 'off' }), [2]);
  assert.deepEqual(kept({ state: 'suspicious' }), [0]);
  assert.deepEqual(kept({ text: 'tilted prism' }), [2]);
  assert.deepEqual(kept({ low: 1.5 }), [3]);
  assert.deepEqual(kept({ high: 0 }), [0]);
});

test('the order of rows', () => {
  const all = Int32Array.from([0, 1, 2, 3]);
  assert.deepEqual([...sorted(columns, all, 'w', true)], [0, 3, 1, 2], 'by size, none last');
  assert.deepEqual([...sorted(columns, all, 'w', false)], [1, 3, 0, 2], 'none last either way');
  assert.deepEqual([...sorted(columns, all, 'from', false)], [3, 1, 2, 0], 'S2 before S10');
  assert.deepEqual([...sorted(columns, all, 'nothing', false)], [0, 1, 2, 3]);
  assert.deepEqual(distinct(columns.from), ['A', 'S2', 'S10']);
});

test('only rows in sight are drawn', () => {
  const { first, last } = inWindow(10000 * 26, 600, 26, 20000);
  assert.ok(first <= 10000 && last >= 10024 && last - first < 60);
  assert.deepEqual(inWindow(0, 600, 26, 3), { first: 0, last: 3 });
  assert.deepEqual(inWindow(9999, 600, 26, 0), { first: 0, last: 0 });
});

test('a table shows every column whole, in as many lines as it needs', () => {
  const columns = [['state', '', 30], ['from', 'From', 104], ['w', 'w', 60], ['value', 'Value', 124], ['source', 'Source', 210]];
  const names = (/** @type {number} */ room) => laidOut(columns, room, 'from', 'source').lines.map((line) => line.map(({ name }) => name));
  assert.deepEqual(names(600), [['state', 'from', 'w', 'value', 'source']]);
  assert.deepEqual(names(400), [['state', 'from', 'w', 'value'], ['source']]);
  assert.deepEqual(names(300), [['state', 'from', 'w'], ['value'], ['source']]);
  for (let room = 0; room < 900; room += 7) {
    const { lines, width } = laidOut(columns, room, 'from', 'source');
    assert.ok(width >= room);
    assert.deepEqual(lines.flat().map(({ name }) => name), columns.map(([name]) => name));
    lines.forEach((line, k) => {
      assert.ok(line.reduce((sum, column) => sum + column.width, k ? 30 : 0) <= width);
      for (const { name, width: given } of line) assert.ok(given >= columns.find(([key]) => key === name)[2]);
    });
  }
});

test('the covariance of a difference comes from the triangle of the joint one', () => {
  // two places that move together but for their own parts
  const n = 6;
  const full = Array.from({ length: n }, (_, i) => Array.from({ length: n }, (_, k) => (i % 3 === k % 3 ? 4 : 0) + (i === k ? i + 1 : 0)));
  full[0][4] = full[4][0] = 0.5;
  const packed = full.flatMap((row, i) => row.slice(0, i + 1));
  const c = ofDifference(packed, 0, 1);
  assert.deepEqual(c, [[1 + 4, -0.5, 0], [-0.5, 2 + 5, 0], [0, 0, 3 + 6]]);
  assert.deepEqual(ofDifference(packed, 1, 0), c);
});
