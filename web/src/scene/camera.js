/**
 * The eye: turned about the point that was under the pointer, moved with it, and drawn near it by the wheel. East is right,
 * north is ahead and up is up in the drawing. Yaw is clockwise from north, pitch up from the horizon.
 */
import * as THREE from 'three';

const FIELD = 45;
const HALF = Math.tan((FIELD * Math.PI) / 360);

export const VIEWS = {
  plan: { title: 'Plan', yaw: 0, pitch: -Math.PI / 2 },
  south: { title: 'From the south', yaw: 0, pitch: 0 },
  east: { title: 'From the east', yaw: -Math.PI / 2, pitch: 0 },
  north: { title: 'From the north', yaw: Math.PI, pitch: 0 },
  west: { title: 'From the west', yaw: Math.PI / 2, pitch: 0 },
};

export class Eye {
  /** @param {() => void} moved */
  constructor(moved) {
    this.moved = moved;
    this.perspective = new THREE.PerspectiveCamera(FIELD, 1, 0.1, 1000);
    this.parallel = new THREE.OrthographicCamera(-1, 1, 1, -1, -1000, 1000);
    for (const camera of [this.perspective, this.parallel]) camera.matrixAutoUpdate = false;
    this.ortho = false;
    this.at = new THREE.Vector3(0, -50, 30);
    this.yaw = 0;
    this.pitch = -0.5;
    this.tall = 50; // metres that the height of the picture shows, at the pivot
    this.pivot = new THREE.Vector3();
    this.ball = new THREE.Sphere(new THREE.Vector3(), 50);
    this.width = 1;
    this.height = 1;
  }

  get camera() {
    return this.ortho ? this.parallel : this.perspective;
  }

  /** Axes of the picture: right, up and ahead. */
  axes(yaw = this.yaw, pitch = this.pitch) {
    const [s, c] = [Math.sin(yaw), Math.cos(yaw)];
    const right = new THREE.Vector3(c, -s, 0);
    const ahead = new THREE.Vector3(s * Math.cos(pitch), c * Math.cos(pitch), Math.sin(pitch));
    return { right, ahead, up: right.clone().cross(ahead) };
  }

  #turn(yaw = this.yaw, pitch = this.pitch) {
    const { right, up, ahead } = this.axes(yaw, pitch);
    return new THREE.Matrix4().makeBasis(right, up, ahead.negate());
  }

  /** Write the state into the camera. */
  apply() {
    const aspect = this.width / this.height;
    const matrix = this.#turn().setPosition(this.at);
    const { ahead } = this.axes();
    const depth = this.ball.center.clone().sub(this.at).dot(ahead);
    const far = Math.max(10, depth + this.ball.radius * 1.2);
    if (this.ortho) {
      const half = this.tall / 2;
      Object.assign(this.parallel, { left: -half * aspect, right: half * aspect, top: half, bottom: -half });
      this.parallel.near = depth - this.ball.radius * 1.2 - 10;
      this.parallel.far = depth + this.ball.radius * 1.2 + 10;
    } else {
      this.perspective.aspect = aspect;
      this.perspective.far = far;
      this.perspective.near = Math.max(far * 2e-4, Math.min(0.5, far * 1e-3), depth - this.ball.radius * 1.2);
    }
    const camera = this.camera;
    camera.matrix.copy(matrix);
    camera.matrixWorld.copy(matrix);
    camera.matrixWorldInverse.copy(matrix).invert();
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld(true);
  }

  #done() {
    this.apply();
    this.moved();
  }

  size(width, height) {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
    this.#done();
  }

  /** Everything in the picture, from where one looks now. @param {THREE.Box3} box @param {number} share of the distance at which all of it is seen */
  fit(box, share = 1.02) {
    if (box.isEmpty()) return;
    const centre = box.getCenter(new THREE.Vector3());
    const { right, up, ahead } = this.axes();
    const aspect = this.width / this.height;
    const corners = [];
    for (const x of [box.min.x, box.max.x]) for (const y of [box.min.y, box.max.y]) for (const z of [box.min.z, box.max.z])
      corners.push(new THREE.Vector3(x, y, z).sub(centre));
    let away = 1;
    let tall = 1;
    for (const corner of corners) {
      const [r, u, a] = [corner.dot(right), corner.dot(up), corner.dot(ahead)];
      away = Math.max(away, Math.abs(u) / HALF - a, Math.abs(r) / HALF / aspect - a);
      tall = Math.max(tall, 2 * Math.abs(u), (2 * Math.abs(r)) / aspect);
    }
    this.pivot.copy(centre);
    this.tall = this.ortho ? tall * 1.06 : away * 2 * HALF;
    this.at.copy(centre).addScaledVector(ahead, this.ortho ? -this.ball.radius : -away * share);
    this.#done();
  }

  /** @param {string} name of VIEWS @param {THREE.Box3} box */
  look(name, box) {
    const view = VIEWS[name];
    if (!view) return;
    this.ortho = true;
    this.yaw = view.yaw;
    this.pitch = view.pitch;
    this.fit(box);
  }

  /** Go on from the same place with the other projection. @param {boolean} ortho */
  project(ortho) {
    if (ortho === this.ortho) return;
    const { ahead } = this.axes();
    if (ortho) {
      const depth = Math.max(0.5, this.pivot.clone().sub(this.at).dot(ahead));
      this.tall = 2 * depth * HALF;
    } else {
      const depth = this.pivot.clone().sub(this.at).dot(ahead);
      this.at.addScaledVector(ahead, depth - this.tall / (2 * HALF));
    }
    this.ortho = ortho;
    this.#done();
  }

  /** @param {THREE.Vector3} about @param {number} yaw @param {number} pitch radians to turn by */
  orbit(about, yaw, pitch) {
    const seen = about.clone().sub(this.at).applyMatrix4(this.#turn().invert());
    this.yaw += yaw;
    this.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.pitch + pitch));
    this.at.copy(about).sub(seen.applyMatrix4(this.#turn()));
    this.pivot.copy(about);
    this.#done();
  }

  /** Metres of one pixel at a point. @param {THREE.Vector3} point */
  metresOfPixel(point) {
    if (this.ortho) return this.tall / this.height;
    const depth = Math.max(0.05, point.clone().sub(this.at).dot(this.axes().ahead));
    return (2 * depth * HALF) / this.height;
  }

  /** Move with the pointer. @param {THREE.Vector3} held what is under it @param {number} dx @param {number} dy pixels */
  pan(held, dx, dy) {
    const metres = this.metresOfPixel(held);
    const { right, up } = this.axes();
    this.at.addScaledVector(right, -dx * metres).addScaledVector(up, dy * metres);
    this.pivot.copy(held).addScaledVector(right, -dx * metres).addScaledVector(up, dy * metres);
    this.#done();
  }

  /** @param {THREE.Vector3} towards @param {number} factor below 1 is nearer */
  zoom(towards, factor) {
    if (this.ortho) {
      const { right, up } = this.axes();
      const off = towards.clone().sub(this.at);
      const share = 1 - factor;
      this.at.addScaledVector(right, off.dot(right) * share).addScaledVector(up, off.dot(up) * share);
      this.tall = Math.min(1e5, Math.max(0.01, this.tall * factor));
    } else {
      const off = this.at.clone().sub(towards);
      const away = off.length();
      const wanted = Math.min(this.ball.radius * 20, Math.max(0.15, away * factor));
      if (away > 1e-9) this.at.copy(towards).addScaledVector(off, wanted / away);
      this.pivot.copy(towards);
    }
    this.#done();
  }

  /** Look at a point from not too far. @param {THREE.Vector3} point @param {number} within metres */
  visit(point, within) {
    const { ahead } = this.axes();
    if (this.ortho) {
      const { right, up } = this.axes();
      const off = point.clone().sub(this.at);
      this.at.addScaledVector(right, off.dot(right)).addScaledVector(up, off.dot(up));
      this.tall = Math.min(this.tall, within * 2);
    } else {
      const away = Math.min(within, Math.max(1, point.distanceTo(this.at)));
      this.at.copy(point).addScaledVector(ahead, -away);
    }
    this.pivot.copy(point);
    this.#done();
  }

  /** The point at the depth of the pivot that is seen at a place of the screen. */
  under(x, y) {
    const camera = this.camera;
    const depth = this.pivot.clone().project(camera).z;
    const z = Math.min(0.9999, Math.max(-0.9999, depth));
    return new THREE.Vector3((x / this.width) * 2 - 1, 1 - (y / this.height) * 2, z).unproject(camera);
  }

  /** Look from a place at another, both in the drawing. @param {number[]} eye @param {number[]} at */
  between(eye, at) {
    const d = new THREE.Vector3(...at).sub(new THREE.Vector3(...eye));
    this.ortho = false;
    this.yaw = Math.atan2(d.x, d.y);
    this.pitch = Math.atan2(d.z, Math.hypot(d.x, d.y));
    this.at.fromArray(eye);
    this.pivot.fromArray(at);
    this.tall = 2 * d.length() * HALF;
    this.#done();
  }

  state() {
    return { eye: this.at.toArray(), yaw: this.yaw, pitch: this.pitch, ortho: this.ortho, height: this.tall };
  }

  /** @param {ReturnType<Eye['state']>} state */
  restore(state) {
    this.at.fromArray(state.eye);
    this.yaw = state.yaw;
    this.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, state.pitch));
    this.ortho = state.ortho;
    this.tall = state.height;
    const { ahead } = this.axes();
    this.pivot.copy(this.at).addScaledVector(ahead, state.ortho ? this.ball.radius : state.height / (2 * HALF));
    this.#done();
  }
}

/**
 * Pointer, wheel and keys on the picture.
 * @param {HTMLElement} element
 * @param {Eye} eye
 * @param {{hit: (x: number, y: number) => THREE.Vector3 | null, click: (x: number, y: number, event: PointerEvent) => void,
 *   hover: (x: number, y: number) => void, grab: (x: number, y: number) => ((dx: number, dy: number) => void) | null,
 *   visit: (x: number, y: number) => void}} does
 */
export function steer(element, eye, does) {
  const down = new Map();
  let held = null;
  let grabbed = null;
  let travelled = 0;
  let wheelHit = null;
  let wheelAt = 0;
  const place = (event) => {
    const box = element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  element.addEventListener('pointerdown', (event) => {
    const [x, y] = place(event);
    try {
      element.setPointerCapture(event.pointerId);
    } catch {
      // a pointer that is gone already
    }
    down.set(event.pointerId, [x, y]);
    if (down.size === 1) {
      travelled = 0;
      held = null;
      grabbed = event.button === 0 ? does.grab(x, y) : null;
    }
  });
  element.addEventListener('pointermove', (event) => {
    const [x, y] = place(event);
    const before = down.get(event.pointerId);
    if (!before) {
      does.hover(x, y);
      return;
    }
    const [dx, dy] = [x - before[0], y - before[1]];
    if (down.size === 2) {
      const other = [...down.entries()].find(([id]) => id !== event.pointerId)?.[1];
      held ??= does.hit((x + other[0]) / 2, (y + other[1]) / 2) ?? eye.under((x + other[0]) / 2, (y + other[1]) / 2);
      const [was, is] = [Math.hypot(before[0] - other[0], before[1] - other[1]), Math.hypot(x - other[0], y - other[1])];
      if (was > 5 && is > 5) eye.zoom(held, was / is);
      eye.pan(held, dx / 2, dy / 2);
      travelled = 99;
    } else {
      travelled += Math.hypot(dx, dy);
      if (travelled > 3) {
        if (grabbed) grabbed(dx, dy);
        else {
          held ??= does.hit(...before) ?? eye.under(...before);
          const pans = event.shiftKey || event.buttons !== 1 || (eye.ortho && !event.ctrlKey);
          if (pans) eye.pan(held, dx, dy);
          else eye.orbit(held, (dx / eye.width) * 3.2, (-dy / eye.height) * 2.2);
        }
      }
    }
    down.set(event.pointerId, [x, y]);
  });
  const end = (event) => {
    if (!down.delete(event.pointerId)) return;
    const [x, y] = place(event);
    if (event.type === 'pointerup' && event.button === 0 && travelled <= 3 && down.size === 0) does.click(x, y, event);
    held = null;
    if (!down.size) grabbed = null;
  };
  element.addEventListener('pointerup', end);
  element.addEventListener('pointercancel', end);
  element.addEventListener('contextmenu', (event) => event.preventDefault());
  element.addEventListener('dblclick', (event) => does.visit(...place(event)));
  element.addEventListener(
    'wheel',
    (event) => {
      event.preventDefault();
      const [x, y] = place(event);
      const now = performance.now();
      if (now - wheelAt > 350) wheelHit = does.hit(x, y) ?? eye.under(x, y);
      wheelAt = now;
      const lines = event.deltaMode === 1 ? event.deltaY * 30 : event.deltaY;
      eye.zoom(wheelHit, Math.exp(Math.max(-300, Math.min(300, lines)) * 0.0015));
    },
    { passive: false },
  );
  element.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = 40;
    const arrows = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const arrow = arrows[event.key];
    if (arrow) {
      if (event.shiftKey || eye.ortho) eye.pan(eye.pivot.clone(), arrow[0] * step, arrow[1] * step);
      else eye.orbit(eye.pivot.clone(), arrow[0] * 0.08, -arrow[1] * 0.06);
    } else if (event.key === '+' || event.key === '=') eye.zoom(eye.pivot.clone(), 0.85);
    else if (event.key === '-') eye.zoom(eye.pivot.clone(), 1 / 0.85);
    else return;
    event.preventDefault();
  });
}
