/**
 * All clouds of the scene: what is asked for, what is held, what is drawn. Loading goes on when a node arrives and when the
 * camera moves, and never waits for a frame.
 */
import * as THREE from 'three';
import { Copc } from 'copc';
import { choose, grown } from './choose.js';
import { layout } from './decode.js';
import { Source } from './source.js';
import * as drawn from './material.js';
import { rgb, SCALES, STATIONS, scaleOf, table } from '../core/colour.js';
import { carried } from '../core/matrix.js';

const WORKERS = Math.max(2, Math.min(4, (navigator.hardwareConcurrency || 2) - 1));
/** Nodes that are asked for at a time, for each worker. */
const DEPTH = 2;
/** How many times the budget is kept in memory. */
const KEPT = 1.6;

export class Clouds {
  /**
   * @param {any} scene of the file
   * @param {THREE.Camera} camera
   * @param {() => void} changed called when there is something new to draw
   * @param {(words: string) => void} failed
   * @param {() => void} gone called when nobody answers
   */
  constructor(scene, camera, changed, failed, gone) {
    this.camera = camera;
    this.changed = changed;
    this.failed = failed;
    this.gone = gone;
    this.origin = scene.origin;
    this.frame = scene.frame ?? [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    this.budget = 2_000_000;
    this.height = 800;
    this.shared = drawn.shared();
    this.group = new THREE.Group();
    this.group.matrixAutoUpdate = false;
    this.tables = new Map(Object.keys(SCALES).map((name) => [name, tableTexture(name)]));
    this.shared.uTable.value = this.tables.get('viridis');
    this.attribute = 'station';
    // by the order of the stations, not of the clouds, which come as they are ready
    const scanners = (scene.stations?.name ?? []).filter((_, i) => scene.stations.kind[i] === 'scanner');
    const stations = [...new Set([...scanners, ...(scene.clouds ?? []).map((cloud) => cloud.station)])];
    this.stationColours = new Map(stations.map((name, i) => [name, STATIONS[i % STATIONS.length]]));
    this.clouds = (scene.clouds ?? []).map((cloud) => this.#made(cloud));
    this.tick = 0;
    this.shownPoints = 0;
    this.chosen = [];
    this.pending = new Map();
    this.task = 0;
    this.firstAt = null;
    this.timer = 0;
    this.busy = [];
    this.workers = Array.from({ length: WORKERS }, (_, i) => {
      const worker = new Worker(new URL('cloud-worker.js', import.meta.url));
      this.busy[i] = 0;
      worker.onmessage = (event) => this.#arrived(i, event.data);
      worker.onerror = (event) => this.failed(`the decoder of clouds cannot start: ${event.message ?? 'no reason is given'}`);
      return worker;
    });
  }

  #made(entry) {
    const group = new THREE.Group();
    group.matrixAutoUpdate = false;
    this.group.add(group);
    const cloud = {
      entry, name: entry.name, station: entry.station, visible: true, group, state: 'none',
      nodes: new Map(), source: null, header: null, layout: null, root: null, cube: null, spacing: 1,
      material: drawn.material(this.shared, rgb(this.stationColours.get(entry.station) ?? STATIONS[0])),
      carried: null,
    };
    this.#lacks(cloud);
    return cloud;
  }

  /** Clouds that became ready meanwhile. @param {any[]} entries */
  add(entries) {
    for (const entry of entries) {
      if (this.clouds.some((cloud) => cloud.name === entry.name)) continue;
      if (!this.stationColours.has(entry.station)) {
        this.stationColours.set(entry.station, STATIONS[this.stationColours.size % STATIONS.length]);
      }
      this.clouds.push(this.#made(entry));
    }
    this.soon();
    this.changed();
  }

  /** Points of the clouds that are switched on. */
  get total() {
    return this.clouds.reduce((sum, cloud) => sum + (cloud.visible ? cloud.entry.points ?? 0 : 0), 0);
  }
  get loading() {
    return this.pending.size + this.clouds.filter((cloud) => cloud.state === 'opening').length;
  }

  async #open(cloud) {
    cloud.state = 'opening';
    try {
      const url = new URL(cloud.entry.url, document.baseURI);
      if (url.origin !== location.origin) throw new Error(`${cloud.name}: its address is on another host`);
      cloud.source = new Source(url.href);
      cloud.get = (begin, end) => cloud.source.get(begin, end);
      const copc = await Copc.create(cloud.get);
      cloud.layout = layout(copc.header, copc.eb);
      const cube = copc.info.cube;
      cloud.cube = { least: cube.slice(0, 3), edge: cube[3] - cube[0] };
      cloud.spacing = copc.info.spacing;
      grown(cloud, await Copc.loadHierarchyPage(cloud.get, copc.info.rootHierarchyPage));
      cloud.root = cloud.nodes.get('0-0-0-0') ?? null;
      cloud.state = 'open';
    } catch (error) {
      cloud.state = 'failed';
      cloud.unheard = Boolean(error?.silent);
      this.#lost(cloud, error?.message ?? error, error?.silent);
    }
    this.soon();
    this.changed();
  }

  async #page(node) {
    const page = node.page;
    if (node.state === 'page') return;
    node.state = 'page';
    try {
      grown(node.cloud, await Copc.loadHierarchyPage(node.cloud.get, page));
      node.state = 'none';
    } catch (error) {
      node.unheard = Boolean(error?.silent);
      this.#lost(node.cloud, error?.message ?? error, error?.silent);
    }
    this.soon();
  }

  /** The place of a node in the drawing. */
  #placed(node) {
    const o = this.origin;
    const f = this.frame;
    const d = [node.centre[0] - o[0], node.centre[1] - o[1], node.centre[2] - o[2]];
    const at = f.map((row) => row[0] * d[0] + row[1] * d[1] + row[2] * d[2]);
    return new THREE.Matrix4().set(
      f[0][0], f[0][1], f[0][2], at[0],
      f[1][0], f[1][1], f[1][2], at[1],
      f[2][0], f[2][1], f[2][2], at[2],
      0, 0, 0, 1,
    );
  }

  /** Choose and ask again, shortly: many calls become one. */
  soon() {
    if (this.timer) return;
    this.timer = setTimeout(() => {
      this.timer = 0;
      this.update();
    }, 40);
  }

  update() {
    const open = this.clouds.filter((cloud) => cloud.visible);
    let opening = open.filter((cloud) => cloud.state === 'opening').length;
    for (const cloud of open) {
      if (cloud.state === 'none' && opening < 6) {
        opening++;
        this.#open(cloud);
      }
    }
    const camera = this.camera;
    camera.updateMatrixWorld();
    const frustum = new THREE.Frustum().setFromProjectionMatrix(
      new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse),
    );
    const eye = new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld);
    const ortho = Boolean(camera.isOrthographicCamera);
    const scale = this.pixelsOfMetre();
    const ball = new THREE.Sphere();
    const slice = this.shared.uSlice.value ? this.#sliceBall() : null;
    const pixels = (node) => {
      node.matrix ??= this.#placed(node);
      ball.center.setFromMatrixPosition(node.matrix);
      ball.radius = node.radius;
      if (!frustum.intersectsSphere(ball)) return 0;
      if (slice && !slice.intersectsSphere(ball)) return 0;
      if (ortho) return scale;
      return scale / Math.max(0.5, eye.distanceTo(ball.center) - 0.6 * node.radius);
    };
    const roots = open.filter((cloud) => cloud.root).map((cloud) => cloud.root);
    const choice = choose(roots, { budget: this.budget, pixels, finest: 1.2 });
    for (const node of choice.pages) this.#page(node);
    this.chosen = choice.nodes;
    this.tick++;
    for (const node of choice.nodes) node.used = this.tick;
    this.#show();
    this.#ask();
    this.#forget();
  }

  pixelsOfMetre() {
    const camera = this.camera;
    return (camera.projectionMatrix.elements[5] * this.height) / 2;
  }

  #sliceBall() {
    const half = this.shared.uSliceHalf.value;
    return new THREE.Sphere(this.shared.uSliceCentre.value.clone(), half.length());
  }

  #show() {
    let shown = 0;
    for (const cloud of this.clouds) {
      for (const object of cloud.group.children) object.visible = false;
      cloud.group.visible = cloud.visible;
    }
    for (const node of this.chosen) {
      if (!node.points) continue;
      node.points.visible = true;
      shown += node.count;
    }
    // points are as large as the finest nodes that cover the same room leave between them
    const finest = (node) => {
      let spacing = node.spacing;
      for (const child of node.children ?? []) {
        if (child.points?.visible) spacing = Math.min(spacing, finest(child));
      }
      node.drawnSpacing = spacing;
      return spacing;
    };
    for (const cloud of this.clouds) if (cloud.root && cloud.visible) finest(cloud.root);
    if (shown !== this.shownPoints || this.shownTick !== this.tick) this.changed();
    this.shownPoints = shown;
    this.shownTick = this.tick;
  }

  #ask() {
    for (const node of this.chosen) {
      if (node.state !== 'none') continue;
      const i = this.busy.indexOf(Math.min(...this.busy));
      if (this.busy[i] >= DEPTH) return;
      const task = ++this.task;
      node.state = 'asked';
      this.pending.set(task, node);
      this.busy[i]++;
      const cloud = node.cloud;
      const blob = cloud.source.blob?.slice(node.offset, node.offset + node.length) ?? null;
      this.workers[i].postMessage({
        task, url: cloud.source.url, blob, layout: cloud.layout,
        offset: node.offset, length: node.length, centre: node.centre, count: node.count,
      });
    }
  }

  /** A cloud without the attribute is drawn in one plain colour. */
  #lacks(cloud) {
    cloud.material.uniforms.uLacks.value = this.attribute !== 'station' && !cloud.entry.attributes?.[this.attribute];
    cloud.material.uniformsNeedUpdate = true;
  }

  /** Ask again for what nobody answered. */
  again() {
    for (const cloud of this.clouds) {
      if (cloud.unheard) Object.assign(cloud, { state: 'none', unheard: false });
      for (const node of cloud.nodes.values()) if (node.unheard) Object.assign(node, { state: 'none', unheard: false });
    }
    this.soon();
  }

  /** What cannot be loaded: a sentence of its own where nobody answers at all. */
  #lost(cloud, words, silent) {
    if (silent) this.gone();
    else this.failed(`${cloud.name}: ${words}`);
  }

  #arrived(i, { task, columns, error, silent }) {
    this.busy[i]--;
    const node = this.pending.get(task);
    this.pending.delete(task);
    if (!node) return;
    if (error) {
      node.state = 'failed';
      node.unheard = Boolean(silent);
      this.#lost(node.cloud, error, silent);
    } else {
      node.state = 'ready';
      node.columns = columns;
      const points = new THREE.Points(drawn.geometry(columns), node.cloud.material);
      points.matrixAutoUpdate = false;
      points.frustumCulled = false;
      node.matrix ??= this.#placed(node);
      points.matrix.copy(node.matrix);
      points.matrixWorldNeedsUpdate = true;
      points.userData.node = node;
      points.onBeforeRender = () => {
        node.cloud.material.uniforms.uSpacing.value = node.drawnSpacing ?? node.spacing;
        node.cloud.material.uniformsNeedUpdate = true;
      };
      node.points = points;
      node.cloud.group.add(points);
      this.firstAt ??= performance.now();
    }
    this.soon();
    this.#ask();
  }

  #forget() {
    let held = 0;
    const ready = [];
    for (const cloud of this.clouds) {
      for (const node of cloud.nodes.values()) {
        if (!node.points) continue;
        held += node.count;
        if (node.used !== this.tick) ready.push(node);
      }
    }
    this.held = held;
    if (held <= this.budget * KEPT) return;
    ready.sort((a, b) => a.used - b.used);
    for (const node of ready) {
      if (held <= this.budget * KEPT) break;
      held -= node.count;
      node.cloud.group.remove(node.points);
      node.points.geometry.dispose();
      node.points = null;
      node.columns = null;
      node.state = 'none';
    }
    this.held = held;
  }

  /** @param {string} attribute @param {[number, number]} range */
  colour(attribute, range) {
    this.shared.uMode.value = Math.max(0, drawn.MODES.indexOf(attribute));
    this.shared.uRange.value.set(range[0], range[1] > range[0] ? range[1] : range[0] + 1e-12);
    this.shared.uTable.value = this.tables.get(scaleOf(attribute));
    this.attribute = attribute;
    for (const cloud of this.clouds) this.#lacks(cloud);
    this.changed();
  }

  /**
   * Carry the clouds of the stations to where an adjustment has put them.
   * @param {Map<string, {before: number[][] | null, now: number[][] | null}>} poses
   */
  carry(poses) {
    for (const cloud of this.clouds) {
      const pose = poses.get(cloud.station);
      const matrix = new THREE.Matrix4();
      if (pose?.before && pose.now && pose.before !== pose.now) {
        const { turn, shift } = carried(pose.before, pose.now, this.frame, this.origin);
        matrix.set(
          turn[0][0], turn[0][1], turn[0][2], shift[0],
          turn[1][0], turn[1][1], turn[1][2], shift[1],
          turn[2][0], turn[2][1], turn[2][2], shift[2],
          0, 0, 0, 1,
        );
      }
      cloud.group.matrix.copy(matrix);
      cloud.group.matrixWorldNeedsUpdate = true;
    }
    this.changed();
  }

  /**
   * The point under a place of the screen: of those within reach, the one that is nearest to the eye, allowing for how far
   * beside the place it is.
   * @param {number} x pixels @param {number} y pixels @param {number} width @param {number} height @param {number} reach pixels
   */
  pick(x, y, width, height, reach = 8) {
    const camera = this.camera;
    camera.updateMatrixWorld();
    const view = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    const all = new THREE.Matrix4();
    const eye = new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld);
    const ahead = new THREE.Vector3();
    camera.getWorldDirection(ahead);
    const centre = new THREE.Vector3();
    const scale = this.pixelsOfMetre();
    const slice = this.shared.uSlice.value;
    let best = null;
    for (const node of this.chosen) {
      if (!node.points || !node.cloud.visible) continue;
      node.points.updateWorldMatrix(true, false);
      const world = node.points.matrixWorld;
      centre.setFromMatrixPosition(world);
      // out of reach as a whole?
      const depth = centre.clone().sub(eye).dot(ahead);
      if (!camera.isOrthographicCamera && depth < -node.radius) continue;
      const projected = centre.clone().project(camera);
      if (depth > node.radius * 1.2 || camera.isOrthographicCamera) {
        const pixels = camera.isOrthographicCamera ? scale : scale / Math.max(0.1, depth - node.radius);
        const beside = Math.hypot(((projected.x + 1) / 2) * width - x, ((1 - projected.y) / 2) * height - y);
        if (beside > node.radius * pixels * 1.1 + reach) continue;
      }
      const e = all.multiplyMatrices(view, world).elements;
      const position = node.columns.position;
      for (let i = 0; i < node.count; i++) {
        const [px, py, pz] = [position[3 * i], position[3 * i + 1], position[3 * i + 2]];
        const w = e[3] * px + e[7] * py + e[11] * pz + e[15];
        if (w <= 0) continue;
        const dx = (((e[0] * px + e[4] * py + e[8] * pz + e[12]) / w + 1) / 2) * width - x;
        const dy = ((1 - (e[1] * px + e[5] * py + e[9] * pz + e[13]) / w) / 2) * height - y;
        const off = dx * dx + dy * dy;
        if (off > reach * reach) continue;
        const z = (e[2] * px + e[6] * py + e[10] * pz + e[14]) / w;
        if (z < -1 || z > 1) continue;
        const away = camera.isOrthographicCamera ? z : w;
        const score = away * (1 + 0.003 * Math.sqrt(off)) + (camera.isOrthographicCamera ? 0.0005 * Math.sqrt(off) : 0);
        if (best && score >= best.score) continue;
        if (slice && !this.inSlice(new THREE.Vector3(px, py, pz).applyMatrix4(world))) continue;
        best = { score, node, i, world };
      }
    }
    if (!best) return null;
    return this.described(best.node, best.i);
  }

  /** @param {THREE.Vector3} p in the drawing */
  inSlice(p) {
    const s = this.shared;
    const d = p.clone().sub(s.uSliceCentre.value);
    const [c, n] = [s.uSliceTurn.value.x, s.uSliceTurn.value.y];
    const half = s.uSliceHalf.value;
    return Math.abs(c * d.x + n * d.y) <= half.x && Math.abs(c * d.y - n * d.x) <= half.y && Math.abs(d.z) <= half.z;
  }

  /** What is known of one point here. */
  described(node, i) {
    const c = node.columns;
    const own = [c.position[3 * i], c.position[3 * i + 1], c.position[3 * i + 2]];
    const draw = new THREE.Vector3(...own).applyMatrix4(node.points.matrixWorld);
    return {
      cloud: node.cloud.name, station: node.cloud.station, node: node.key, index: i,
      // as the file has it: work frame of the run
      xyz: own.map((x, k) => x + node.centre[k]),
      draw: [draw.x, draw.y, draw.z],
      sigma: c.sigma ? [c.sigma[3 * i], c.sigma[3 * i + 1], c.sigma[3 * i + 2]] : null,
      intensity: c.intensity[i],
      incidence: c.incidence ? c.incidence[i] / 100 : null,
      distance: c.distance ? c.distance[i] : null,
      level: c.level ? c.level[i] : null,
      further: Boolean(node.cloud.entry.further),
      rgb: c.rgb ? [...c.rgb.slice(3 * i, 3 * i + 3)] : null,
    };
  }
}

function tableTexture(name) {
  const texture = new THREE.DataTexture(table(name), 256, 1, THREE.RGBAFormat);
  texture.minFilter = texture.magFilter = THREE.NearestFilter;
  texture.needsUpdate = true;
  return texture;
}
