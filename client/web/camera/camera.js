// The camera: a CameraView message, and moves that keep the y axis up. Angles in radians, lengths in the scene's unit.

import { add, cross, dot, fromMessage, length, normalize, rotate, scale, subtract, toMessage } from './vectors.js';

const UP = [0, 1, 0];
const STEEPEST = 0.9998; // |cosine| of the angle between the view and the y axis
const DEFAULT_FOV = 0.8;
const FARTHEST = 1e6; // from the scene's middle, in sizes of the scene
const MOST = 1e12; // of a coordinate, as CameraView has it
const REACH = 1e11; // of a camera that is moved: so much nearer that what it looks at is in range, too

// Lowest and highest, as CameraView has them; 0 is in range of each: its default, or none.
const OPTICS = {
  vertical_fov: [0.0017, 3.1242],
  orthographic_half_height: [1e-12, MOST],
  lens_radius: [0, MOST],
  focus_distance: [1e-12, MOST],
  aspect: [1e-6, 1e6],
};
const NAMES = Object.keys(OPTICS);

function isInRange(name, value) {
  const [low, high] = OPTICS[name];
  return value === 0 || (value >= low && value <= high);
}

// Whether the numbers of Camera.toText are a camera that the daemon takes.
export function isCamera(n) {
  if (n.length !== 17 || !n.every(Number.isFinite)) return false;
  const [position, forward, up, pivot] = [0, 3, 6, 9].map((from) => n.slice(from, from + 3));
  const optics = n.slice(12);
  if (![...position, ...up, ...pivot].every((v) => Math.abs(v) <= MOST)) return false;
  if (!(length(cross(normalize(forward), normalize(up))) > 1e-6)) return false; // parallel, or one is zero
  return NAMES.every((name, i) => isInRange(name, optics[i])) && !(optics[0] && optics[1]);
}

export class Camera {
  constructor() {
    this.position = [0, 0, 1];
    this.forward = [0, 0, -1];
    this.up = UP;
    this.pivot = [0, 0, 0];
    this.size = 1; // half the scene's diagonal: the step of flying and panning
    this.middle = [0, 0, 0]; // of the scene
    this.optics = {}; // fields of CameraView besides the place
    this.exact = null; // the scene's own message, while nothing has been moved
    this.home = null;
  }

  // Of the pivot, along the view: what is at the pivot's depth moves with the pointer.
  get distance() {
    return Math.max(dot(subtract(this.pivot, this.position), this.forward), 1e-6 * this.size);
  }
  get target() {
    return add(this.position, scale(this.forward, this.distance));
  }
  get right() {
    return normalize(cross(this.forward, this.up));
  }

  // Looks through a camera of the scene, or frames all of it.
  start(scene) {
    const low = fromMessage(scene.bounds_min ?? {}),
      high = fromMessage(scene.bounds_max ?? {});
    this.size = Math.max(length(subtract(high, low)) / 2, 1e-9);
    const centre = scale(add(low, high), 0.5);
    this.middle = centre;
    if (scene.cameras.length) {
      this.read(scene.cameras[0].view, centre);
    } else {
      this.optics = { vertical_fov: DEFAULT_FOV };
      this.forward = normalize([-0.5, -0.35, -1]);
      this.up = UP;
      this.pivot = centre;
      this.position = subtract(centre, scale(this.forward, this.size / Math.sin(DEFAULT_FOV / 2)));
      this.exact = null;
    }
    this.home = this.save();
  }

  // Takes a CameraView; its pivot is the point ahead that is nearest to `centre`.
  read(view, centre) {
    const { position, look_at, rotation, scene_camera, ...optics } = view;
    this.optics = optics;
    this.position = fromMessage(position);
    if (rotation) {
      this.forward = normalize(turned(rotation, [0, 0, -1]));
      this.up = normalize(turned(rotation, UP));
    } else {
      const target = fromMessage(look_at.target);
      this.forward = normalize(subtract(target, this.position));
      this.up = look_at.up ? fromMessage(look_at.up) : UP;
    }
    const ahead = dot(subtract(centre, this.position), this.forward);
    this.pivot = add(this.position, scale(this.forward, ahead > 0.01 * this.size ? ahead : this.size));
    this.exact = view;
  }

  // Nothing was moved: the scene's first camera.
  get isHome() {
    return this.exact !== null && this.exact === this.home?.exact;
  }

  message() {
    if (this.exact) return this.exact;
    const told = new Camera();
    told.size = this.size;
    // A link, which has these digits alone, gives the same bits.
    told.#take(this.toText().split(',').map(Number));
    return {
      ...told.optics,
      position: toMessage(told.position),
      look_at: { target: toMessage(told.target), up: toMessage(told.up) },
    };
  }

  save() {
    const { position, forward, up, pivot, optics, exact } = this;
    return { position, forward, up, pivot, optics: { ...optics }, exact };
  }

  restore(saved) {
    Object.assign(this, saved, { optics: { ...saved.optics } });
  }

  // How far from the scene's middle the camera may move.
  get #reach() {
    return Math.min(FARTHEST * this.size, REACH);
  }

  // Brings a point back to within the camera's reach.
  #within(point) {
    const offset = subtract(point, this.middle),
      far = length(offset);
    return far <= this.#reach ? point : add(this.middle, scale(offset, this.#reach / far));
  }

  #moved() {
    this.exact = null;
    this.position = this.#within(this.position);
    if (Math.abs(dot(this.forward, UP)) < STEEPEST) this.up = UP;
  }

  // By angles, around the pivot, which stays where it is seen.
  orbit(yaw, pitch) {
    const turn = this.#turn(yaw, pitch);
    this.position = add(this.pivot, turn(subtract(this.position, this.pivot)));
  }

  // Answers the rotation of the view's direction by angles.
  #turn(yaw, pitch) {
    this.#moved();
    const level = (v) => rotate(v, UP, yaw);
    const across = normalize(level(this.right));
    const both = (v) => rotate(level(v), across, pitch);
    const turn = Math.abs(dot(both(this.forward), UP)) < STEEPEST ? both : level;
    this.forward = normalize(turn(this.forward));
    return turn;
  }

  // With the pivot.
  move(offset) {
    const from = this.position;
    this.position = this.#within(add(from, offset));
    this.pivot = add(this.pivot, subtract(this.position, from));
    this.#moved();
  }

  // Moves with the pivot's plane, so that the point under the pointer stays there. dx, dy: of the picture's height.
  pan(dx, dy) {
    const tall = this.orthographic ? 2 * this.optics.orthographic_half_height : 2 * this.distance * this.tangent(1e9);
    const { right } = this,
      up = cross(right, this.forward);
    this.move(add(scale(right, -dx * tall), scale(up, dy * tall)));
  }

  // Towards the point of the pivot's plane that is seen at (u, v) of the picture, [-1, 1], v up.
  dolly(factor, u, v, aspect) {
    if (this.orthographic) {
      const half = this.optics.orthographic_half_height * factor;
      this.optics.orthographic_half_height = Math.min(Math.max(half, this.size / FARTHEST, 1e-12), this.#reach);
      this.#moved();
      return;
    }
    const { origin, direction } = this.ray(u, v, aspect);
    const reach = this.distance / dot(direction, this.forward);
    this.position = add(origin, scale(direction, reach * (1 - factor)));
    this.#moved();
  }

  get orthographic() {
    return (this.optics.orthographic_half_height ?? 0) > 0;
  }

  // Of half the vertical angle, in a picture of this aspect (CameraView.aspect).
  tangent(aspect) {
    const tangent = Math.tan((this.optics.vertical_fov || DEFAULT_FOV) / 2),
      own = this.optics.aspect || 0;
    return own > aspect ? (tangent * own) / aspect : tangent;
  }

  ray(u, v, aspect) {
    const { right } = this,
      up = cross(right, this.forward);
    if (this.orthographic) {
      const half = this.optics.orthographic_half_height;
      return {
        origin: add(this.position, add(scale(right, u * half * aspect), scale(up, v * half))),
        direction: this.forward,
      };
    }
    const tangent = this.tangent(aspect);
    const direction = normalize(add(this.forward, add(scale(right, u * tangent * aspect), scale(up, v * tangent))));
    return { origin: this.position, direction };
  }

  // The point at `depth` along the ray through (u, v).
  pointAt(u, v, aspect, depth) {
    const { origin, direction } = this.ray(u, v, aspect);
    return add(origin, scale(direction, depth));
  }

  // Focuses the lens on a point; a pinhole gets a lens of 1/200 of that distance.
  focus(point) {
    const distance = Math.max(dot(subtract(point, this.position), this.forward), 1e-9);
    this.set({ focus_distance: distance, lens_radius: this.optics.lens_radius || distance / 200 });
  }

  // Brings the numbers into their range.
  set(optics) {
    for (const [name, value] of Object.entries(optics)) {
      const [low, high] = OPTICS[name];
      this.optics[name] = value === 0 ? 0 : Math.min(Math.max(value, low), high);
    }
    this.exact = null;
  }

  reset() {
    if (this.home) this.restore(this.home);
  }

  // As numbers for the URL, and back.
  toText() {
    const short = (x) => Number(x.toPrecision(9));
    const {
      vertical_fov = 0,
      orthographic_half_height = 0,
      lens_radius = 0,
      focus_distance = 0,
      aspect = 0,
    } = this.optics;
    return [
      ...this.position,
      ...this.forward,
      ...this.up,
      ...this.pivot,
      vertical_fov,
      orthographic_half_height,
      lens_radius,
      focus_distance,
      aspect,
    ]
      .map(short)
      .join(',');
  }

  fromText(text) {
    const n = text.split(',').map(Number);
    if (!isCamera(n)) return false;
    this.#take(n);
    return true;
  }

  #take(n) {
    this.position = n.slice(0, 3);
    this.forward = n.slice(3, 6);
    this.up = n.slice(6, 9);
    this.pivot = n.slice(9, 12);
    const [vertical_fov, orthographic_half_height, lens_radius, focus_distance, aspect] = n.slice(12);
    this.optics = { vertical_fov, orthographic_half_height, lens_radius, focus_distance, aspect };
    this.exact = null;
  }
}

function turned({ x = 0, y = 0, z = 0, w = 0 }, v) {
  const q = [x, y, z],
    t = scale(cross(q, v), 2);
  return add(add(v, scale(t, w)), cross(q, t));
}
