/** What the network looks like: ellipsoids, rays, edges, planes, arrows of what moved. All in the axes of the drawing. */
import * as THREE from 'three';
import { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { ofTest } from '../core/colour.js';
import { eigen, length, turned } from '../core/matrix.js';
import { median, roundDown } from '../core/statistics.js';

export const ROLES = {
  control: { colour: '#c8372d', symbol: 'triangle', title: 'control' },
  check: { colour: '#2b6cd4', symbol: 'diamond', title: 'check' },
  free: { colour: '#12876a', symbol: 'circle', title: 'free' },
  station: { colour: '#5a4fcf', symbol: 'square', title: 'station' },
};

/** @param {string} role */
export const look = (role) => ROLES[role] ?? ROLES.free;

function lines(width, over) {
  const material = new LineMaterial({
    linewidth: width, vertexColors: true, transparent: true, depthTest: !over, depthWrite: false, opacity: over ? 0.22 : 0.95,
  });
  const object = new LineSegments2(new LineSegmentsGeometry(), material);
  object.frustumCulled = false;
  object.visible = false;
  return object;
}

function fill(object, places, colours) {
  object.geometry.dispose();
  object.geometry = new LineSegmentsGeometry();
  if (places.length) {
    object.geometry.setPositions(places);
    object.geometry.setColors(colours);
  }
  object.userData.some = places.length > 0;
}

const MOVED = [0.91, 0.12, 0.55];

/** What is known of a displacement between epochs. */
export const VERDICTS = {
  moved: { colour: '#d6246e', rgb: [0.84, 0.14, 0.43] },
  'not moved': { colour: '#3d7f95', rgb: [0.24, 0.5, 0.58] },
  'cannot tell': { colour: '#c98a12', rgb: [0.79, 0.54, 0.07] },
};

/** Arrows over everything, each with its colour. */
class Arrows {
  /** @param {THREE.Scene} scene */
  constructor(scene) {
    this.scene = scene;
    this.visible = true;
    this.lines = lines(3.5, true);
    this.lines.material.opacity = 1;
    this.cone = new THREE.ConeGeometry(0.5, 1, 16).translate(0, -0.5, 0);
    this.paint = new THREE.MeshBasicMaterial({ depthTest: false, transparent: true });
    this.heads = null;
    scene.add(this.lines);
  }

  /** @param {{from: number[], moved: number[], colour: number[]}[]} moves in the work frame @param {number} times @param {NetworkView} view */
  set(moves, times, view) {
    if (this.heads) {
      this.scene.remove(this.heads);
      this.heads.dispose();
    }
    const places = [];
    const colours = [];
    const shown = moves.filter((move) => length(move.moved) > 0);
    const heads = new THREE.InstancedMesh(this.cone, this.paint, shown.length);
    heads.frustumCulled = false;
    const up = new THREE.Vector3(0, 1, 0);
    shown.forEach((move, i) => {
      const a = new THREE.Vector3(...view.toDrawing(move.from));
      const d = new THREE.Vector3(...view.toAxes(move.moved)).multiplyScalar(times);
      const b = a.clone().add(d);
      const long = d.length();
      places.push(...a.toArray(), ...b.clone().addScaledVector(d, -0.3).toArray());
      colours.push(...move.colour, ...move.colour);
      heads.setMatrixAt(
        i,
        new THREE.Matrix4().compose(
          b,
          new THREE.Quaternion().setFromUnitVectors(up, d.clone().normalize()),
          new THREE.Vector3(long * 0.28, long * 0.36, long * 0.28),
        ),
      );
      heads.setColorAt(i, new THREE.Color(...move.colour));
    });
    heads.renderOrder = 5;
    fill(this.lines, places, colours);
    this.heads = heads;
    this.scene.add(heads);
    this.show(this.visible);
  }

  /** @param {boolean} on */
  show(on) {
    this.visible = on;
    this.lines.visible = on && Boolean(this.lines.userData.some);
    if (this.heads) this.heads.visible = on;
  }
}

export class NetworkView {
  /** @param {(xyz: number[]) => number[]} toDrawing @param {number[][]} frame @param {number} factor from sigmas to the axes of the ellipsoids */
  constructor(toDrawing, frame, factor) {
    this.toDrawing = toDrawing;
    this.frame = frame;
    this.factor = factor;
    this.scene = new THREE.Scene();
    this.front = new THREE.Scene();
    const sky = new THREE.HemisphereLight(0xffffff, 0x8a8f99, 2.0);
    sky.position.set(0, 0, 1);
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(-0.5, -0.8, 1.2);
    this.scene.add(sky, sun);
    this.rayLines = lines(1.25, false);
    this.rayLines.material.opacity = 0.6;
    this.rayGhosts = lines(1.1, true);
    this.rayGhosts.material.opacity = 0.14;
    this.badRays = lines(2.6, true);
    this.badRays.material.opacity = 0.95;
    this.edgeLines = lines(3.5, false);
    this.edgeGhosts = lines(3, true);
    this.marked = lines(4, true);
    this.marked.material.opacity = 1;
    this.planeLines = lines(1.5, false);
    this.box = lines(1.5, true);
    this.box.material.opacity = 0.9;
    this.scene.add(this.rayLines, this.edgeLines, this.planeLines);
    this.front.add(this.rayGhosts, this.badRays, this.edgeGhosts, this.box, this.marked);
    this.moves = new Arrows(this.front);
    this.epochs = new Arrows(this.front);
    this.epochBalls = null;
    this.ellipsoids = null;
    this.planes = new THREE.Group();
    this.planes.visible = false;
    this.scene.add(this.planes);
    this.rays = [];
    this.edges = [];
  }

  get materials() {
    return [this.rayLines, this.rayGhosts, this.badRays, this.edgeLines, this.edgeGhosts, this.marked, this.planeLines, this.box,
      this.moves.lines, this.epochs.lines].map((object) => object.material);
  }

  size(width, height) {
    for (const material of this.materials) material.resolution.set(width, height);
  }

  /** Exaggeration at which the ellipsoids are seen beside a scene of this size. @param {any[]} items @param {number} radius */
  static exaggeration(items, radius) {
    const axes = items.filter((p) => p.covariance).map((p) => Math.sqrt(Math.max(0, eigen(p.covariance).values[0])));
    const middle = median(axes.filter((x) => x > 0));
    return middle > 0 ? Math.max(1, roundDown((0.03 * radius) / middle)) : 1;
  }

  /** @param {any[]} items with xyz, covariance (3x3) and role @param {number} times */
  setEllipsoids(items, times) {
    this.#drop(this.ellipsoids);
    const shown = items.filter((p) => p.covariance && p.xyz);
    this.ellipsoids = this.#balls(shown, times, 0.82);
    this.ellipsoids.visible = this.ellipsoidsVisible ?? true;
    this.ellipsoidCount = shown.length;
    this.scene.add(this.ellipsoids);
  }

  #drop(mesh) {
    if (!mesh) return;
    this.scene.remove(mesh);
    mesh.dispose();
  }

  /** Ellipsoids at places. @param {any[]} shown @param {number} times @param {number} opacity */
  #balls(shown, times, opacity) {
    const skins = (this.skins ??= new Map());
    if (!skins.has(opacity)) skins.set(opacity, new THREE.MeshLambertMaterial({ transparent: true, opacity }));
    const mesh = new THREE.InstancedMesh((this.ball ??= new THREE.SphereGeometry(1, 32, 20)), skins.get(opacity), shown.length);
    mesh.frustumCulled = false;
    const matrix = new THREE.Matrix4();
    shown.forEach((p, i) => {
      const { values, vectors } = eigen(turned(this.frame, p.covariance));
      const s = values.map((v) => Math.sqrt(Math.max(v, 1e-16)) * this.factor * times);
      const at = this.toDrawing(p.xyz);
      matrix.set(
        vectors[0][0] * s[0], vectors[0][1] * s[1], vectors[0][2] * s[2], at[0],
        vectors[1][0] * s[0], vectors[1][1] * s[1], vectors[1][2] * s[2], at[1],
        vectors[2][0] * s[0], vectors[2][1] * s[1], vectors[2][2] * s[2], at[2],
        0, 0, 0, 1,
      );
      // a left-handed set of axes would turn the skin inside out
      if (matrix.determinant() < 0) {
        const e = matrix.elements;
        e[8] *= -1;
        e[9] *= -1;
        e[10] *= -1;
      }
      mesh.setMatrixAt(i, matrix);
      mesh.setColorAt(i, new THREE.Color(p.hex ?? look(p.role).colour));
    });
    return mesh;
  }

  /** @param {{from: number[], to: number[], w: number | null, suspicious: boolean, off: boolean}[]} rays in the work frame */
  setRays(rays, dark) {
    this.rays = rays.map((ray) => ({ ...ray, a: this.toDrawing(ray.from), b: this.toDrawing(ray.to) }));
    const [places, colours, bad, red] = [[], [], [], []];
    for (const ray of this.rays) {
      if (ray.off) continue;
      const colour = ofTest(ray.w, ray.suspicious, dark);
      (ray.suspicious ? bad : places).push(...ray.a, ...ray.b);
      (ray.suspicious ? red : colours).push(...colour, ...colour);
    }
    fill(this.rayLines, places, colours);
    fill(this.rayGhosts, places, colours);
    fill(this.badRays, bad, red);
    this.rayCount = (places.length + bad.length) / 6;
  }

  /** @param {{from: number[], to: number[], share: number | null, outlying: boolean}[]} edges */
  setEdges(edges) {
    const places = [];
    const colours = [];
    this.edges = edges.map((edge) => ({ ...edge, a: this.toDrawing(edge.from), b: this.toDrawing(edge.to) }));
    for (const edge of this.edges) {
      const colour = edge.outlying ? [0.86, 0.13, 0.15] : [0.36, 0.31, 0.81];
      places.push(...edge.a, ...edge.b);
      colours.push(...colour, ...colour);
    }
    fill(this.edgeLines, places, colours);
    fill(this.edgeGhosts, places, colours);
  }

  /**
   * @param {{normal: number[], centre: number[], extent: number, axes?: number[][] | null, half?: number[] | null}[]} planes in the frame
   *   of the clouds: rectangles along their axes; without them squares of the extent, which is a radius
   */
  setPlanes(planes) {
    this.planes.clear();
    const places = [];
    const colours = [];
    for (const plane of planes) {
      const n = new THREE.Vector3(...this.toAxes(plane.normal)).normalize();
      const flat = Math.abs(n.z) > 0.99 ? new THREE.Vector3(0, 1, 0) : new THREE.Vector3(0, 0, 1);
      let u = flat.clone().cross(n).normalize();
      let v = n.clone().cross(u);
      let [a, b] = [plane.extent || 1, plane.extent || 1];
      if (plane.axes && plane.half) {
        [u, v] = plane.axes.map((axis) => new THREE.Vector3(...this.toAxes(axis)));
        [a, b] = plane.half;
      }
      const at = new THREE.Vector3(...this.toDrawing(plane.centre));
      const corners = [[-a, -b], [a, -b], [a, b], [-a, b]].map(([s, t]) => at.clone().addScaledVector(u, s).addScaledVector(v, t));
      for (let i = 0; i < 4; i++) {
        places.push(...corners[i].toArray(), ...corners[(i + 1) % 4].toArray());
        colours.push(0.1, 0.55, 0.62, 0.1, 0.55, 0.62);
      }
      const geometry = new THREE.BufferGeometry().setFromPoints([corners[0], corners[1], corners[2], corners[0], corners[2], corners[3]]);
      this.planes.add(
        new THREE.Mesh(
          geometry,
          (this.glass ??= new THREE.MeshBasicMaterial({ color: 0x1a8c9e, transparent: true, opacity: 0.22, side: THREE.DoubleSide, depthWrite: false })),
        ),
      );
    }
    fill(this.planeLines, places, colours);
  }

  toAxes(v) {
    return this.frame.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
  }

  /** Arrows of moves. @param {{from: number[], moved: number[]}[]} moves @param {number} times @param {number} smallest metres worth an arrow */
  setMoves(moves, times, smallest) {
    const shown = moves.filter((move) => length(move.moved) > smallest).map((move) => ({ ...move, colour: MOVED }));
    this.moves.set(shown, times, this);
    this.moveCount = shown.length;
  }

  /** Displacements between epochs: arrows by what is known of them, ellipsoids of their covariances at the tips. */
  setEpochs(points, times) {
    this.epochs.set(points.map((p) => ({ ...p, colour: VERDICTS[p.verdict]?.rgb ?? MOVED })), times, this);
    this.epochCount = points.length;
    this.#drop(this.epochBalls);
    const tips = points.map((p) => ({ ...p, xyz: p.from.map((x, k) => x + times * p.moved[k]), hex: VERDICTS[p.verdict]?.colour }));
    this.epochBalls = this.#balls(tips, times, 0.4);
    this.epochBalls.visible = this.epochs.visible;
    this.scene.add(this.epochBalls);
  }

  /** @param {number[][] | null} ends pairs of places in the drawing @param {number[]} colour */
  mark(ends, colour = [1, 0.76, 0.03]) {
    const places = [];
    const colours = [];
    for (const [a, b] of ends ?? []) {
      places.push(...a, ...b);
      colours.push(...colour, ...colour);
    }
    fill(this.marked, places, colours);
    this.marked.visible = places.length > 0;
  }

  /** @param {{centre: number[], half: number[], turn: number} | null} slice */
  setBox(slice) {
    const places = [];
    const colours = [];
    if (slice) {
      const [c, s] = [Math.cos(slice.turn), Math.sin(slice.turn)];
      const corner = (i, j, k) => {
        const [x, y, z] = [i * slice.half[0], j * slice.half[1], k * slice.half[2]];
        return [slice.centre[0] + c * x - s * y, slice.centre[1] + s * x + c * y, slice.centre[2] + z];
      };
      const ends = [];
      for (const i of [-1, 1]) for (const j of [-1, 1]) {
        ends.push([corner(i, j, -1), corner(i, j, 1)], [corner(i, -1, j), corner(i, 1, j)], [corner(-1, i, j), corner(1, i, j)]);
      }
      for (const [a, b] of ends) {
        places.push(...a, ...b);
        colours.push(0.95, 0.55, 0.05, 0.95, 0.55, 0.05);
      }
    }
    fill(this.box, places, colours);
    this.box.visible = Boolean(slice);
  }

  /** @param {(layer: string) => boolean} on */
  show(on) {
    this.ellipsoidsVisible = on('ellipsoids');
    if (this.ellipsoids) this.ellipsoids.visible = this.ellipsoidsVisible;
    this.rayLines.visible = this.rayGhosts.visible = on('rays') && Boolean(this.rayLines.userData.some);
    this.badRays.visible = on('rays') && Boolean(this.badRays.userData.some);
    this.edgeLines.visible = this.edgeGhosts.visible = on('edges') && Boolean(this.edgeLines.userData.some);
    this.planes.visible = on('planes');
    this.planeLines.visible = on('planes') && Boolean(this.planeLines.userData.some);
    this.moves.show(on('moves'));
    this.epochs.show(on('epochs'));
    if (this.epochBalls) this.epochBalls.visible = on('epochs');
  }
}

/** Distance of a place of the screen to a piece of a line, and how far along. @param {number[]} p @param {number[]} a @param {number[]} b */
export function beside(p, a, b) {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const t = Math.min(1, Math.max(0, ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / (dx * dx + dy * dy || 1)));
  return { distance: Math.hypot(a[0] + t * dx - p[0], a[1] + t * dy - p[1]), t };
}
