// A body in its world, seen from afar: parallel projection, so that lengths can be compared.

import { rotate } from "./quaternion.js";
import { FONT } from "./surface.js";

// From behind, from the right, from above; degrees.
export const HOME = { azimuth: -125, elevation: 24 };
// Length of an axis as a part of the smaller side of the canvas.
const SCALE = 0.4;
const BOX = [0.46, 0.3, 0.085];
const LIGHT = [-0.35, -0.45, 0.82];
const FACES = [0, 1, 2].flatMap((axis) => [1, -1].map((side) => ({ axis, side })));
const AGES = 10;
const TIP = 4.5;

export class Camera {
  constructor() {
    this.home();
  }

  home() {
    Object.assign(this, HOME);
  }

  orbit(azimuth, elevation) {
    this.azimuth = ((this.azimuth + azimuth + 540) % 360) - 180;
    this.elevation = Math.max(-90, Math.min(90, this.elevation + elevation));
  }

  // World (z up) to [right, up, towards the eye].
  turn(v) {
    const [a, e] = [(this.azimuth * Math.PI) / 180, (this.elevation * Math.PI) / 180];
    const [sa, ca, se, ce] = [Math.sin(a), Math.cos(a), Math.sin(e), Math.cos(e)];
    return [
      -sa * v[0] + ca * v[1],
      -se * ca * v[0] - se * sa * v[1] + ce * v[2],
      ce * ca * v[0] + ce * sa * v[1] + se * v[2],
    ];
  }
}

// Drag, arrows and double click move the camera.
export function steer(canvas, camera, moved) {
  let from = null;
  canvas.addEventListener("pointerdown", (event) => {
    from = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!from) return;
    camera.orbit((from[0] - event.clientX) * 0.5, (event.clientY - from[1]) * 0.5);
    from = [event.clientX, event.clientY];
    moved();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => (from = null));
  canvas.addEventListener("dblclick", () => {
    camera.home();
    moved();
  });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] }[event.key];
    if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
    camera.orbit(...step);
    event.preventDefault();
    event.stopPropagation();
    moved();
  });
}

export class Scene {
  constructor(surface, camera, colours) {
    this.context = surface.begin();
    this.camera = camera;
    this.colours = colours;
    this.names = [];
    this.centre = [surface.width / 2, surface.height / 2];
    this.scale = SCALE * Math.min(surface.width, surface.height);
  }

  // World (z up, unit = length of an axis) to [x, y, depth] on the canvas.
  project(v) {
    const [right, up, depth] = this.camera.turn(v);
    return [this.centre[0] + this.scale * right, this.centre[1] - this.scale * up, depth];
  }

  path(points) {
    this.context.beginPath();
    points.forEach(([x, y], n) => (n ? this.context.lineTo(x, y) : this.context.moveTo(x, y)));
  }

  circle(of) {
    const points = [];
    for (let n = 0; n <= 72; n++) points.push(this.project(of((n * Math.PI) / 36)));
    this.path(points);
    this.context.stroke();
  }

  // The unit sphere and its horizon, with the world's axes on it.
  world(names) {
    const { context, colours } = this;
    context.strokeStyle = colours.grid;
    context.fillStyle = colours.muted;
    context.lineWidth = 1;
    context.beginPath();
    context.arc(...this.centre, this.scale, 0, 2 * Math.PI);
    context.stroke();
    this.circle((a) => [Math.cos(a), Math.sin(a), 0]);
    this.path([this.project([-1, 0, 0]), this.project([1, 0, 0])]);
    context.stroke();
    this.path([this.project([0, -1, 0]), this.project([0, 1, 0])]);
    context.stroke();
    this.labels = names.map((name, axis) => {
      const v = [0, 0, 0];
      v[axis] = 1.18;
      return [name, ...this.project(v)];
    });
  }

  // The names of the world's axes, but where something else is written.
  label(taken) {
    const { context, colours } = this;
    context.font = `11px ${FONT}`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillStyle = colours.muted;
    for (const [name, x, y] of this.labels) {
      if (taken.every((t) => Math.hypot(t[0] - x, t[1] - y) > 20)) context.fillText(name, x, y);
    }
  }

  // Points on the sphere, oldest first, fading with age; `front` says which half is drawn.
  locus(points, colour, front, width = 1.75, dash = [], behind = 0.3) {
    const { context } = this;
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    const last = points.length - 1;
    for (let age = 0; age < AGES; age++) {
      const [from, to] = [Math.floor((age * last) / AGES), Math.floor(((age + 1) * last) / AGES)];
      context.globalAlpha = (0.12 + (0.88 * (age + 1)) / AGES) * (front ? 1 : behind);
      context.beginPath();
      let drawing = false;
      for (let n = from; n <= to; n++) {
        const point = points[n];
        const [x, y, depth] = point ? this.project(point) : [0, 0, 0];
        const shown = point && depth >= 0 === front;
        if (shown && drawing) context.lineTo(x, y);
        else if (shown) context.moveTo(x, y);
        drawing = shown;
      }
      context.stroke();
    }
    context.globalAlpha = 1;
    context.setLineDash([]);
  }

  // The box and the body's axes; `toWorld` takes body to world (z up).
  body(toWorld) {
    const { context, colours } = this;
    const axes = [0, 1, 2].map((axis) => toWorld([0, 1, 2].map((n) => (n === axis ? 1 : 0))));
    const isNear = axes.map((axis) => this.camera.turn(axis)[2] > 0);
    axes.forEach((axis, n) => !isNear[n] && this.axis(axis, n));
    for (const { axis, side } of FACES) {
      const normal = axes[axis].map((v) => v * side);
      if (this.camera.turn(normal)[2] <= 0) continue;
      const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
      const corner = (a, b) => {
        const at = [0, 0, 0];
        at[axis] = side * BOX[axis];
        at[u] = a * BOX[u];
        at[v] = b * BOX[v];
        return this.project(toWorld(at));
      };
      const light = normal.reduce((sum, n, k) => sum + n * LIGHT[k], 0);
      this.path([corner(1, 1), corner(1, -1), corner(-1, -1), corner(-1, 1)]);
      context.closePath();
      context.fillStyle = colours.surface;
      context.fill();
      context.globalAlpha = 0.45 + 0.4 * Math.max(0, light);
      context.fillStyle = axis === 0 && side > 0 ? colours.x : colours.box;
      context.fill();
      context.globalAlpha = 1;
      context.strokeStyle = colours.line;
      context.lineWidth = 1;
      context.stroke();
    }
    axes.forEach((axis, n) => isNear[n] && this.axis(axis, n));
    this.tips = axes.map((axis) => this.project(axis).slice(0, 2));
  }

  // The axes of another body alone, thin.
  triad(toWorld, { width = 1.5, dash = [4, 4], name = "" } = {}) {
    const { context, colours } = this;
    context.setLineDash(dash);
    const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(toWorld);
    axes.forEach((axis, n) => this.axis(axis, n, width));
    context.setLineDash([]);
    if (!name) return;
    let [x, y] = this.project(axes[0].map((v) => 1.1 * v));
    // Of names that would lie on each other the first is written.
    const isLeft = x < this.centre[0];
    if (this.names.some((other) => Math.abs(other.y - y) < 13 && (other.isLeft === isLeft || Math.abs(other.x - x) < 120))) return;
    this.names.push({ x, y, isLeft });
    context.font = `600 11px ${FONT}`;
    context.textAlign = isLeft ? "right" : "left";
    context.textBaseline = "middle";
    // Not beyond the border.
    const { width: long } = context.measureText(name);
    x = isLeft ? Math.max(x, long + 3) : Math.min(x, 2 * this.centre[0] - long - 3);
    context.lineWidth = 3;
    context.strokeStyle = colours.surface;
    context.strokeText(name, x, y);
    context.fillStyle = colours.text;
    context.fillText(name, x, y);
  }

  axis(direction, n, width = 3) {
    const { context, colours } = this;
    context.strokeStyle = [colours.x, colours.y, colours.z][n];
    context.lineWidth = width;
    this.path([this.project([0, 0, 0]), this.project(direction)]);
    context.stroke();
  }

  arrow(direction, colour, width = 2, dash = []) {
    const { context } = this;
    const [from, to] = [this.project([0, 0, 0]), this.project(direction)];
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    const length = Math.hypot(dx, dy);
    context.strokeStyle = colour;
    context.fillStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    this.path([from, to]);
    context.stroke();
    context.setLineDash([]);
    if (length < 8) return;
    const [ux, uy] = [dx / length, dy / length];
    this.path([
      [to[0] + ux * 3, to[1] + uy * 3],
      [to[0] - ux * 7 - uy * 4, to[1] - uy * 7 + ux * 4],
      [to[0] - ux * 7 + uy * 4, to[1] - uy * 7 - ux * 4],
    ]);
    context.closePath();
    context.fill();
  }

  // The ends of the axes, over everything: each disc is centred on the projected point.
  ends() {
    const { context, colours } = this;
    const letters = this.tips.map(([x, y]) => {
      const [dx, dy] = [x - this.centre[0], y - this.centre[1]];
      const length = Math.hypot(dx, dy);
      const [ux, uy] = length > 1 ? [dx / length, dy / length] : [0.7, -0.7];
      return [x + ux * 14, y + uy * 14];
    });
    this.label(letters);
    context.font = `600 12px ${FONT}`;
    letters.forEach(([x, y], n) => {
      context.fillStyle = [colours.x, colours.y, colours.z][n];
      context.fillText("xyz"[n], x, y);
    });
    this.tips.forEach(([x, y], n) => {
      context.fillStyle = [colours.x, colours.y, colours.z][n];
      context.beginPath();
      context.arc(x, y, TIP + 1.5, 0, 2 * Math.PI);
      context.fill();
      context.fillStyle = colours.tip;
      context.beginPath();
      context.arc(x, y, TIP - 1, 0, 2 * Math.PI);
      context.fill();
    });
  }
}

// World vector of an attitude's world -> z up, x forward or north.
export function upright(world) {
  return world === "ned" ? (v) => [v[0], -v[1], -v[2]] : (v) => v;
}

export function worldNames(world) {
  return { enu: ["E", "N", "up"], nwu: ["N", "W", "up"], ned: ["N", "W", "up"], level: ["x₀", "y₀", "up"] }[world] ?? ["x₀", "y₀", "z₀"];
}

// At most this many points of a path.
const MOST = 400;

// The z axis over the `seconds` up to number `last`, in the world of `view` (z up), oldest first.
export function zLocus(history, seconds, view, last) {
  const points = [];
  if (!(last >= history.oldest)) return points;
  const from = history.firstFrom(history.timeOf(last) - seconds);
  const step = Math.ceil((last + 1 - from) / MOST) || 1;
  const add = (number) => points.push(view(rotate(history.attitude(number), [0, 0, 1])));
  // Numbers are multiples of the step, so that a path does not tremble as it grows.
  for (let n = Math.ceil(from / step) * step; n <= last; n += step) {
    if (history.broken[history.slot(n)]) points.push(null);
    add(n);
  }
  add(last);
  return points;
}
