import assert from 'node:assert/strict';
import { test } from 'node:test';
import { choose, grown, Heap } from '../src/cloud/choose.js';
import { decoded, layout } from '../src/cloud/decode.js';
import { Source } from '../src/cloud/source.js';
import { arranged, Room } from '../src/scene/labels.js';

/** Numbers that are the same on every run. */
function random(seed) {
  let x = seed;
  return () => {
    x = (1103515245 * x + 12345) % 2147483648;
    return x / 2147483648;
  };
}

test('the heap gives the largest first', () => {
  const next = random(7);
  const heap = new Heap();
  const weights = Array.from({ length: 500 }, next);
  for (const w of weights) heap.push(w, w);
  const out = [];
  while (heap.size) out.push(heap.pop());
  assert.deepEqual(out, weights.sort((a, b) => b - a));
  assert.equal(heap.pop(), undefined);
});

function tree(levels, count) {
  const nodes = {};
  const add = (d, x, y, z) => {
    nodes[`${d}-${x}-${y}-${z}`] = { pointCount: count, pointDataOffset: 1, pointDataLength: 1 };
    if (d < levels) for (const k of [0, 1, 2, 3, 4, 5, 6, 7]) add(d + 1, 2 * x + (k & 1), 2 * y + ((k >> 1) & 1), 2 * z + (k >> 2));
  };
  add(0, 0, 0, 0);
  const cloud = { cube: { least: [100, 200, 300], edge: 64 }, spacing: 1, nodes: new Map() };
  grown(cloud, { nodes, pages: {} });
  return cloud;
}

test('nodes of a page find their parents and places', () => {
  const cloud = tree(2, 10);
  assert.equal(cloud.nodes.size, 1 + 8 + 64);
  const node = cloud.nodes.get('2-3-0-1');
  assert.deepEqual(node.centre, [100 + 3.5 * 16, 200 + 0.5 * 16, 300 + 1.5 * 16]);
  assert.equal(node.spacing, 0.25);
  for (const child of cloud.nodes.get('0-0-0-0').children) assert.equal(child.children.length, 8);
});

test('a page that comes later is put where its place was kept', () => {
  const cloud = { cube: { least: [0, 0, 0], edge: 8 }, spacing: 1, nodes: new Map() };
  grown(cloud, { nodes: { '0-0-0-0': { pointCount: 5, pointDataOffset: 0, pointDataLength: 1 } }, pages: { '1-0-0-0': { pageOffset: 9, pageLength: 32 } } });
  const root = cloud.nodes.get('0-0-0-0');
  assert.equal(root.children.length, 1);
  assert.ok(root.children[0].page);
  grown(cloud, { nodes: { '1-0-0-0': { pointCount: 7, pointDataOffset: 0, pointDataLength: 1 } }, pages: {} });
  assert.equal(root.children.length, 1);
  assert.equal(root.children[0].page, null);
  assert.equal(root.children[0].count, 7);
});

test('the budget is kept, coarse before fine, and what is out of sight is not asked for', () => {
  const cloud = tree(3, 100);
  const root = cloud.nodes.get('0-0-0-0');
  const seen = new Set();
  const { nodes, points } = choose([root], { budget: 1000, finest: 1.2, pixels: (node) => (seen.add(node.key), node.centre[0] > 130 ? 50 : node.level ? 0 : 50) });
  assert.ok(points <= 1000 && points >= 900);
  assert.equal(nodes[0], root);
  for (const node of nodes.slice(1)) assert.ok(node.centre[0] > 130);
  const chosen = new Set(nodes);
  for (const node of nodes) for (const child of node.children ?? []) if (chosen.has(child)) assert.ok(nodes.indexOf(child) > nodes.indexOf(node));
});

test('no finer nodes where points stand closer than the screen can show', () => {
  const root = tree(3, 1).nodes.get('0-0-0-0');
  const { nodes } = choose([root], { budget: 1e9, finest: 1.2, pixels: () => 3 });
  assert.deepEqual([...new Set(nodes.map((n) => n.level))], [0, 1, 2]);
});

test('a small budget still shows something', () => {
  const root = tree(1, 1000).nodes.get('0-0-0-0');
  assert.equal(choose([root], { budget: 10, finest: 1, pixels: () => 100 }).points, 1000);
});

test('records become columns about the centre of their node', () => {
  const header = { pointDataRecordFormat: 7, pointDataRecordLength: 36 + 16, scale: [0.001, 0.001, 0.001], offset: [550000, 5800000, 100] };
  const how = layout(header, [
    { name: 'sigma_x', type: 'float', length: 4 }, { name: 'sigma_y', type: 'float', length: 4 },
    { name: 'sigma_z', type: 'float', length: 4 }, { name: 'incidence', type: 'float', length: 4 },
  ]);
  const bytes = new Uint8Array(2 * 52);
  const view = new DataView(bytes.buffer);
  for (const [i, xyz] of [[0, [1234, -567, 89]], [1, [-1, 2, 3]]]) {
    xyz.forEach((x, k) => view.setInt32(52 * i + 4 * k, x, true));
    view.setUint16(52 * i + 12, 4321, true);
    [65535, 32768, 256].forEach((c, k) => view.setUint16(52 * i + 30 + 2 * k, c, true));
    [0.001, 0.002, 0.003, 45.25].forEach((x, k) => view.setFloat32(52 * i + 36 + 4 * k, x, true));
  }
  const out = decoded(how, bytes, [550001, 5799999, 100], 2);
  const want = [0.234, 0.433, 0.089, -1.001, 1.002, 0.003];
  out.position.forEach((x, i) => assert.ok(Math.abs(x - want[i]) < 1e-6, `${x} is not ${want[i]}`));
  assert.deepEqual([...out.intensity], [4321, 4321]);
  assert.deepEqual([...out.incidence], [4525, 4525]);
  assert.deepEqual([...out.rgb.slice(0, 3)], [255, 128, 1]);
  assert.ok(Math.abs(out.sigma[2] - 0.003) < 1e-9);
});

test('colours of eight bits in fields of sixteen are seen', () => {
  const how = layout({ pointDataRecordFormat: 7, pointDataRecordLength: 36, scale: [1, 1, 1], offset: [0, 0, 0] }, []);
  const bytes = new Uint8Array(36);
  const view = new DataView(bytes.buffer);
  [255, 128, 1].forEach((c, k) => view.setUint16(30 + 2 * k, c, true));
  const out = decoded(how, bytes, [0, 0, 0], 1);
  assert.deepEqual([...out.rgb], [255, 128, 1]);
  assert.equal(out.sigma, null);
});

test('a format that is not of COPC is refused in words', () => {
  assert.throws(() => layout({ pointDataRecordFormat: 3, pointDataRecordLength: 34, scale: [1, 1, 1], offset: [0, 0, 0] }, []), /point format 3/);
});

async function served(handler, does) {
  const { createServer } = await import('node:http');
  const server = createServer(handler);
  await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
  try {
    await does(`http://127.0.0.1:${server.address().port}/x.laz`);
  } finally {
    server.closeAllConnections();
    server.close();
  }
}

const file = Uint8Array.from({ length: 1000 }, (_, i) => i % 251);

test('parts of a file from a server with ranges', async () => {
  await served(
    (request, answer) => {
      const [, a, b] = /bytes=(\d+)-(\d+)/.exec(request.headers.range);
      answer.writeHead(206, { 'Content-Range': `bytes ${a}-${b}/1000` });
      answer.end(Buffer.from(file.slice(Number(a), Number(b) + 1)));
    },
    async (url) => assert.deepEqual(await new Source(url).get(100, 120), file.slice(100, 120)),
  );
});

test('a file is fetched once from a server without ranges', async () => {
  let asked = 0;
  await served(
    (_, answer) => {
      asked++;
      answer.writeHead(200, { 'Content-Length': 1000 });
      answer.end(Buffer.from(file));
    },
    async (url) => {
      const source = new Source(url);
      assert.deepEqual(await source.get(100, 120), file.slice(100, 120));
      assert.deepEqual(await source.get(990, 1000), file.slice(990, 1000));
      assert.equal(asked, 1);
    },
  );
});

test('a file too large to be fetched whole is refused in words', async () => {
  await served(
    (_, answer) => {
      answer.writeHead(200, { 'Content-Length': 300 * 2 ** 20 });
      answer.write('x');
    },
    async (url) => assert.rejects(new Source(url).get(0, 10), /too many to fetch whole/),
  );
});

test('names do not cover each other', () => {
  const next = random(3);
  const marks = Array.from({ length: 300 }, (_, i) => ({ x: next() * 800, y: next() * 600, text: `P${i}`, symbol: 'circle', colour: '#000', weight: i }));
  const places = arranged(marks, (text) => 7 * text.length, 12);
  assert.ok(places.length > 50);
  assert.ok(places.some(({ mark }) => mark.weight === 299), 'the heaviest name has room');
  for (let i = 0; i < places.length; i++) {
    for (let j = 0; j < i; j++) {
      const [a, b] = [places[i], places[j]];
      const apart = a.x + 7 * a.mark.text.length <= b.x || b.x + 7 * b.mark.text.length <= a.x || Math.abs(a.y - b.y) >= 12;
      assert.ok(apart, `${a.mark.text} covers ${b.mark.text}`);
    }
  }
  const room = new Room();
  room.take([0, 0, 10, 10]);
  assert.equal(room.free([5, 5, 20, 20]), false);
  assert.equal(room.free([11, 0, 20, 10]), true);
});
