/** The picture: clouds, network, names, slice. Drawn only when something has changed. */
import * as THREE from 'three';
import { Clouds } from '../cloud/clouds.js';
import { minus, times } from '../core/matrix.js';
import { ellipsoidFactor } from '../core/statistics.js';
import { Composite } from './composite.js';
import { Eye, steer } from './camera.js';
import { FONT, drawLine, drawMarks } from './labels.js';
import { NetworkView, beside } from './network.js';

THREE.ColorManagement.enabled = false;

const THEMES = {
  light: { background: '#f3f5f7', text: '#1b2430', halo: 'rgba(255,255,255,0.92)' },
  dark: { background: '#14181e', text: '#eef2f6', halo: 'rgba(12,15,19,0.9)' },
};

export class Viewer {
  /**
   * @param {HTMLElement} host
   * @param {any} scene
   * @param {{click: (hit: any, event: PointerEvent) => void, hover: (hit: any) => void, camera: () => void, drawn: () => void, loaded: () => void,
   *   failed: (words: string) => void, gone: () => void, sliced: (slice: any) => void}} tell
   */
  constructor(host, scene, tell) {
    this.host = host;
    this.scene = scene;
    this.tell = tell;
    this.frame = scene.frame ?? [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    this.canvas = document.createElement('canvas');
    this.canvas.className = 'picture';
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('role', 'application');
    this.canvas.setAttribute('aria-label', 'Three-dimensional view: arrow keys turn, plus and minus zoom, F fits all');
    this.ink = document.createElement('canvas');
    this.ink.className = 'names';
    this.ink.setAttribute('aria-hidden', 'true');
    host.append(this.canvas, this.ink);
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: false, powerPreference: 'high-performance', preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.renderer.autoClear = false;
    this.eye = new Eye(() => this.#moved());
    this.clouds = new Clouds(scene, this.eye.camera, () => {
      this.#arrived();
      tell.loaded();
    }, tell.failed, tell.gone);
    this.network = new NetworkView((xyz) => this.toDrawing(xyz), this.frame, scene.ellipsoid ?? ellipsoidFactor(scene.confidence ?? 0.95));
    this.cloudScene = new THREE.Scene();
    this.cloudScene.add(this.clouds.group);
    this.composite = new Composite();
    this.marks = [];
    this.notes = [];
    /** Ends of a measured distance in the drawing. */
    this.measured = null;
    this.names = true;
    this.slice = null;
    this.only = 'select';
    this.asked = false;
    this.frames = 0;
    this.theme('light');
    this.box = this.#extent();
    this.eye.ball = this.box.getBoundingSphere(new THREE.Sphere());
    this.eye.ball.radius = Math.max(1, this.eye.ball.radius);
    this.handleMeshes = [];
    steer(this.canvas, this.eye, {
      hit: (x, y) => this.#hit(x, y),
      click: (x, y, event) => tell.click(this.what(x, y), event),
      hover: (x, y) => this.#hover(x, y),
      grab: (x, y) => this.#grab(x, y),
      visit: (x, y) => {
        const p = this.#hit(x, y);
        if (p) this.eye.visit(p, this.eye.ball.radius * 0.3);
      },
    });
    new ResizeObserver(() => this.#resize()).observe(host);
    this.#resize();
    this.home();
  }

  /** @param {number[]} xyz work frame, metres */
  toDrawing(xyz) {
    return times(this.frame, minus(xyz, this.scene.origin));
  }

  /** Everything that has a place, far strays of the cloud apart. */
  #extent() {
    const all = new THREE.Box3();
    const add = (xyz) => xyz && all.expandByPoint(new THREE.Vector3(...this.toDrawing(xyz)));
    for (const xyz of this.scene.points?.xyz ?? []) add(xyz);
    for (const xyz of this.scene.stations?.xyz ?? []) add(xyz);
    for (const cloud of this.scene.clouds ?? []) {
      if (!cloud.bounds) continue;
      const [low, high] = cloud.bounds;
      for (const x of [low[0], high[0]]) for (const y of [low[1], high[1]]) for (const z of [low[2], high[2]]) add([x, y, z]);
    }
    if (all.isEmpty()) all.expandByPoint(new THREE.Vector3(-10, -10, -2)).expandByPoint(new THREE.Vector3(10, 10, 8));
    return all;
  }

  /** The slice, if there is one; else the box of the network, or of everything where there is no cloud to speak of. */
  #core() {
    if (this.slice) {
      const { centre, half, turn } = this.slice;
      const [c, n] = [Math.abs(Math.cos(turn)), Math.abs(Math.sin(turn))];
      const reach = new THREE.Vector3(c * half[0] + n * half[1], n * half[0] + c * half[1], half[2]);
      const at = new THREE.Vector3(...centre);
      return new THREE.Box3(at.clone().sub(reach), at.clone().add(reach));
    }
    const core = new THREE.Box3();
    const add = (xyz) => xyz && core.expandByPoint(new THREE.Vector3(...this.toDrawing(xyz)));
    for (const xyz of this.scene.points?.xyz ?? []) add(xyz);
    for (const xyz of this.scene.stations?.xyz ?? []) add(xyz);
    if (core.isEmpty() || core.getSize(new THREE.Vector3()).length() < 0.1 * this.eye.ball.radius) return this.box;
    return core.expandByScalar(0.04 * core.getSize(new THREE.Vector3()).length());
  }

  home() {
    this.eye.ortho = false;
    this.eye.yaw = 0.55;
    this.eye.pitch = -0.62;
    this.eye.fit(this.#core(), 0.9);
  }
  fit() {
    this.eye.fit(this.box);
  }
  look(name) {
    this.eye.look(name, this.#core());
  }

  theme(name) {
    this.colours = THEMES[name] ?? THEMES.light;
    const c = new THREE.Color(this.colours.background);
    this.composite.uniforms.uBackground.value.set(c.r, c.g, c.b);
    this.dark = name === 'dark';
    this.draw();
  }

  #resize() {
    const width = Math.max(1, this.host.clientWidth);
    const height = Math.max(1, this.host.clientHeight);
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    this.ratio = ratio;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.ink.width = Math.round(width * ratio);
    this.ink.height = Math.round(height * ratio);
    this.composite.size(Math.round(width * ratio), Math.round(height * ratio));
    this.network.size(width, height);
    this.clouds.height = height;
    this.eye.size(width, height);
  }

  #moved() {
    if (!this.clouds) return;
    this.clouds.camera = this.eye.camera;
    this.clouds.soon();
    this.draw();
    this.tell.camera();
  }

  /** Points have come: the first are drawn at once, more of them a few times a second, so that loading is not kept waiting. */
  #arrived() {
    const now = this.clouds?.shownPoints > 0;
    if (!this.clouds?.loading || now !== this.anyShown) {
      this.anyShown = now;
      this.draw();
    } else this.arrivals ??= setTimeout(() => {
      this.arrivals = null;
      this.draw();
    }, 400);
  }

  /** Ask for a picture; many calls become one frame. */
  draw() {
    if (this.asked || !this.clouds) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.#frame();
    });
  }

  #frame() {
    const camera = this.eye.camera;
    this.eye.apply();
    const s = this.clouds.shared;
    s.uPixels.value = this.clouds.pixelsOfMetre() * this.ratio;
    s.uOrtho.value = this.eye.ortho;
    this.composite.draw(this.renderer, this.cloudScene, camera);
    this.renderer.render(this.network.scene, camera);
    this.renderer.render(this.network.front, camera);
    this.#names();
    this.frames++;
    this.tell.drawn();
  }

  /** A place of the drawing on the screen, or null behind the eye. @param {number[]} at */
  onScreen(at) {
    const camera = this.eye.camera;
    const v = new THREE.Vector3(...at);
    if (!this.eye.ortho && v.clone().sub(this.eye.at).dot(this.eye.axes().ahead) < 0.05) return null;
    v.project(camera);
    return [((v.x + 1) / 2) * this.eye.width, ((1 - v.y) / 2) * this.eye.height];
  }

  #names() {
    const ink = this.ink.getContext('2d');
    ink.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    ink.clearRect(0, 0, this.eye.width, this.eye.height);
    this.placed = [];
    const marks = [];
    for (const mark of [...this.marks, ...this.notes]) {
      if (this.slice && !mark.always && !this.clouds.inSlice(new THREE.Vector3(...mark.at))) continue;
      const screen = this.onScreen(mark.at);
      if (!screen) continue;
      const [x, y] = screen;
      if (x < -50 || y < -20 || x > this.eye.width + 20 || y > this.eye.height + 20) continue;
      const placed = { ...mark, x, y };
      marks.push(placed);
      if (mark.what) this.placed.push(placed);
    }
    if (this.measured) {
      const [a, b] = this.measured.map((at) => this.onScreen(at));
      if (a && b) drawLine(ink, a, b, this.colours.halo);
    }
    drawMarks(ink, marks, { text: this.colours.text, halo: this.colours.halo, ratio: this.ratio, names: this.names });
    if (this.slice) this.#handles(ink);
    this.#scaleBar(ink);
    this.#compass(ink);
  }

  #scaleBar(ink) {
    const p = this.eye.ortho ? this.eye.at : this.eye.pivot;
    const metre = 1 / this.eye.metresOfPixel(p);
    const wanted = 120 / metre;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const lead = wanted / power;
    const long = (lead >= 5 ? 5 : lead >= 2 ? 2 : 1) * power;
    const px = long * metre;
    const [x, y] = [this.eye.width - 24 - px, this.eye.height - 22];
    ink.lineWidth = 4;
    ink.strokeStyle = this.colours.halo;
    const path = () => {
      ink.beginPath();
      ink.moveTo(x, y - 5);
      ink.lineTo(x, y);
      ink.lineTo(x + px, y);
      ink.lineTo(x + px, y - 5);
      ink.stroke();
    };
    path();
    ink.lineWidth = 1.5;
    ink.strokeStyle = this.colours.text;
    path();
    const words = `${long >= 1 ? long : long >= 0.01 ? `${Math.round(long * 100)} c` : `${Number((long * 1000).toPrecision(2))} m`}${long >= 1 ? ' ' : ''}m${this.eye.ortho ? '' : ' at the pivot'}`;
    ink.font = `11px ${FONT}`;
    ink.textBaseline = 'alphabetic';
    ink.textAlign = 'center';
    ink.lineWidth = 3;
    ink.strokeStyle = this.colours.halo;
    ink.strokeText(words, Math.min(x + px / 2, this.eye.width - 50), y - 9);
    ink.fillStyle = this.colours.text;
    ink.fillText(words, Math.min(x + px / 2, this.eye.width - 50), y - 9);
    ink.textAlign = 'left';
  }

  #compass(ink) {
    const [cx, cy, r] = [this.eye.width - 52, 50, 24];
    const { right, up } = this.eye.axes();
    ink.beginPath();
    ink.arc(cx, cy, r + 16, 0, 2 * Math.PI);
    ink.fillStyle = this.dark ? 'rgba(20,24,30,0.6)' : 'rgba(255,255,255,0.66)';
    ink.fill();
    const axes = [['E', new THREE.Vector3(1, 0, 0), '#c8372d'], ['N', new THREE.Vector3(0, 1, 0), '#12876a'], ['U', new THREE.Vector3(0, 0, 1), '#2b6cd4']];
    const { ahead } = this.eye.axes();
    axes.sort((a, b) => b[1].dot(ahead) - a[1].dot(ahead));
    ink.font = `600 10px ${FONT}`;
    ink.textBaseline = 'middle';
    ink.textAlign = 'center';
    for (const [name, axis, colour] of axes) {
      const [x, y] = [cx + axis.dot(right) * r, cy - axis.dot(up) * r];
      const long = Math.hypot(x - cx, y - cy);
      ink.strokeStyle = colour;
      ink.lineWidth = 2;
      ink.beginPath();
      ink.moveTo(cx, cy);
      ink.lineTo(x, y);
      ink.stroke();
      if (long < 5) continue;
      const [tx, ty] = [cx + (x - cx) * (1 + 9 / long), cy + (y - cy) * (1 + 9 / long)];
      ink.fillStyle = this.colours.text;
      ink.fillText(name, tx, ty);
    }
    ink.textAlign = 'left';
  }

  /** Look at a place of the drawing. @param {number[]} at @param {number} [within] metres */
  visit(at, within = this.eye.ball.radius * 0.25) {
    this.eye.visit(new THREE.Vector3(...at), within);
  }

  /** A box to begin slicing with: the network, cut to a slab of a tenth of it. */
  slicingBox() {
    this.slice = null;
    const core = this.#core();
    const half = core.getSize(new THREE.Vector3()).multiplyScalar(0.55);
    half.y = Math.max(0.25, half.y * 0.12);
    half.z = Math.max(half.z, 2);
    return { centre: core.getCenter(new THREE.Vector3()).toArray(), half: half.toArray() };
  }

  // -- slice ------------------------------------------------------------------------------------------------------------

  /** @param {{on: boolean, centre: number[], half: number[], turn: number} | null} slice in the axes of the drawing */
  setSlice(slice) {
    this.slice = slice?.on ? slice : null;
    const s = this.clouds.shared;
    s.uSlice.value = Boolean(this.slice);
    if (this.slice) {
      s.uSliceCentre.value.set(...slice.centre);
      s.uSliceHalf.value.set(...slice.half);
      s.uSliceTurn.value.set(Math.cos(slice.turn), Math.sin(slice.turn));
    }
    this.network.setBox(this.slice);
    this.clouds.soon();
    this.draw();
  }

  #faces() {
    const { centre, half, turn } = this.slice;
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    const axes = [[c, s, 0], [-s, c, 0], [0, 0, 1]];
    const out = [];
    for (let k = 0; k < 3; k++) for (const sign of [-1, 1]) {
      out.push({ k, sign, axis: axes[k].map((x) => x * sign), at: centre.map((x, i) => x + axes[k][i] * sign * half[k]) });
    }
    return out;
  }

  /** Where the sides of the slice are taken hold of, on the screen. */
  handles() {
    return this.slice ? this.#faces().map((face) => ({ ...face, screen: this.onScreen(face.at) })) : [];
  }

  #handles(ink) {
    for (const face of this.#faces()) {
      const p = this.onScreen(face.at);
      if (!p) continue;
      ink.beginPath();
      ink.arc(p[0], p[1], 7, 0, 2 * Math.PI);
      ink.fillStyle = '#f28c0d';
      ink.strokeStyle = this.colours.halo;
      ink.lineWidth = 2.5;
      ink.fill();
      ink.stroke();
    }
  }

  #grab(x, y) {
    if (!this.slice) return null;
    for (const face of this.#faces()) {
      const p = this.onScreen(face.at);
      if (!p || Math.hypot(p[0] - x, p[1] - y) > 11) continue;
      return (dx, dy) => {
        const a = this.onScreen(face.at);
        const b = this.onScreen(face.at.map((v, i) => v + face.axis[i] * 0.1));
        if (!a || !b) return;
        const [ux, uy] = [b[0] - a[0], b[1] - a[1]];
        const size = ux * ux + uy * uy;
        if (size < 0.01) return;
        const metres = (0.1 * (dx * ux + dy * uy)) / size;
        const half = [...this.slice.half];
        const wanted = Math.max(0.025, half[face.k] + metres / 2);
        const grown = (wanted - half[face.k]) * 2;
        half[face.k] = wanted;
        const centre = this.slice.centre.map((v, i) => v + (face.axis[i] * grown) / 2);
        face.at = face.at.map((v, i) => v + face.axis[i] * grown);
        this.tell.sliced({ ...this.slice, centre, half });
      };
    }
    return null;
  }

  // -- what is under the pointer -----------------------------------------------------------------------------------------

  #hit(x, y) {
    const point = this.clouds.pick(x, y, this.eye.width, this.eye.height, 12);
    return point ? new THREE.Vector3(...point.draw) : null;
  }

  /** A named thing, a ray, an edge or a point of a cloud. */
  what(x, y, clouds = true) {
    let best = null;
    for (const mark of this.only === 'pick' ? [] : this.placed ?? []) {
      const distance = Math.hypot(mark.x - x, mark.y - y);
      if (distance < 11 && (!best || distance < best.distance)) best = { distance, ...mark.what };
    }
    if (best) return best;
    if (this.only === 'select') {
      for (const [kind, list, on] of [['ray', this.network.rays, this.network.rayLines.visible || this.network.badRays.visible], ['edge', this.network.edges, this.network.edgeLines.visible]]) {
        if (!on) continue;
        for (const item of list) {
          if (item.off) continue;
          const [a, b] = [this.onScreen(item.a), this.onScreen(item.b)];
          if (!a || !b) continue;
          const { distance, t } = beside([x, y], a, b);
          if (distance < 4 && t > 0.02 && t < 0.98 && (!best || distance < best.distance)) best = { type: kind, item, distance };
        }
      }
      if (best) return best;
    }
    if (!clouds) return null;
    const point = this.clouds.pick(x, y, this.eye.width, this.eye.height);
    return point ? { type: 'cloud', point } : null;
  }

  /** Once a frame at most: a large network has many lines to look at. */
  #hover(x, y) {
    this.hoverAt = [x, y];
    if (this.hovering) return;
    this.hovering = true;
    requestAnimationFrame(() => {
      this.hovering = false;
      this.#hovered(...this.hoverAt);
    });
  }

  #hovered(x, y) {
    const hit = this.what(x, y, false);
    const handle = this.slice && this.#grab(x, y);
    this.canvas.classList.toggle('over', Boolean(hit || handle));
    this.tell.hover(hit ? { ...hit, x, y } : null);
  }

  /** Share of the picture that is not background. */
  drawnShare() {
    const gl = this.renderer.getContext();
    const [w, h] = [this.canvas.width, this.canvas.height];
    const pixels = new Uint8Array(4 * w * h);
    this.#frame();
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const b = this.composite.uniforms.uBackground.value.toArray().map((x) => Math.round(x * 255));
    let drawn = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      if (Math.abs(pixels[i] - b[0]) + Math.abs(pixels[i + 1] - b[1]) + Math.abs(pixels[i + 2] - b[2]) > 12) drawn++;
    }
    return drawn / (w * h);
  }
}
