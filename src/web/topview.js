// The top as a cone and a disc, and errors on a logarithmic scale.

import { Scene } from "./body3d.js";
import { rotate } from "./quaternion.js";
import { FONT } from "./surface.js";

const SIDES = 40;
// Radius and height of the profile from the pivot up; unit = length of the axis drawn.
const PROFILE = [[0, 0], [0.16, 0.42], [0.5, 0.5], [0.5, 0.6], [0.07, 0.64], [0.035, 0.95]];
const LIGHT = [-0.4, -0.5, 0.77];

// Faces of the body of revolution, in body axes: corners and normal.
const SURFACES = PROFILE.slice(1).flatMap(([r1, z1], n) => {
  const [r0, z0] = PROFILE[n];
  const slope = Math.hypot(r1 - r0, z1 - z0);
  const [out, up] = [(z1 - z0) / slope, -(r1 - r0) / slope];
  return Array.from({ length: SIDES }, (_, side) => {
    const [a, b] = [side, side + 1].map((s) => (2 * Math.PI * s) / SIDES);
    const middle = (a + b) / 2;
    const corner = (r, angle, z) => [r * Math.cos(angle), r * Math.sin(angle), z];
    return {
      corners: [corner(r0, a, z0), corner(r0, b, z0), corner(r1, b, z1), corner(r1, a, z1)],
      normal: [out * Math.cos(middle), out * Math.sin(middle), up],
      // Quarters of the disc, so that its spin is seen.
      isMarked: Math.floor((4 * side) / SIDES) % 2 === 0,
    };
  });
});

function drawBody(scene, q, colours) {
  const { context } = scene;
  const faces = [];
  for (const { corners, normal, isMarked } of SURFACES) {
    const n = rotate(q, normal);
    if (scene.camera.turn(n)[2] <= 0) continue;
    const points = corners.map((corner) => scene.project(rotate(q, corner)));
    const depth = points.reduce((sum, point) => sum + point[2], 0);
    const light = n[0] * LIGHT[0] + n[1] * LIGHT[1] + n[2] * LIGHT[2];
    faces.push({ points, depth, light, isMarked });
  }
  faces.sort((a, b) => a.depth - b.depth);
  context.lineWidth = 0.8;
  const [box, disc, surface] = [colours.box, colours.method, colours.surface].map(parts);
  const pale = mixed(disc, surface, 0.35);
  for (const { points, light, isMarked } of faces) {
    const lit = mixed(isMarked ? box : pale, surface, 0.4 - 0.4 * Math.max(0, light));
    const colour = `rgb(${lit.map(Math.round).join(" ")})`;
    scene.path(points);
    context.closePath();
    context.fillStyle = colour;
    context.fill();
    // Over the seam to the neighbour.
    context.strokeStyle = colour;
    context.stroke();
  }
}

// Red, green, blue of #rrggbb.
const parts = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

// A colour `part` of the way to another.
const mixed = (from, to, part) => from.map((v, n) => v + (to[n] - v) * part);

const axisOf = (q) => rotate({ w: q[0], x: q[1], y: q[2], z: q[3] }, [0, 0, 1]);

function pathTo(attitudes, until) {
  const points = [];
  const step = Math.max(1, Math.floor(attitudes.length / 600));
  for (let n = 0; n < until; n += step) points.push(axisOf(attitudes[n]));
  points.push(axisOf(attitudes[until]));
  return points;
}

// `run` is what the daemon answered, `at` a number of its instants.
export function drawTop(surface, camera, colours, run, at, { small = false } = {}) {
  const scene = new Scene(surface, camera, colours);
  scene.world(small ? [] : ["x", "y", "up"]);
  const [chosen, euler] = [run.methods[0], run.methods.find((m) => m.name === "euler-angles")];
  const exact = pathTo(run.truth.q, at);
  const found = chosen ? pathTo(chosen.q, at) : [];
  const angles = euler && euler !== chosen ? pathTo(euler.q, at) : [];
  const loci = (front) => {
    const line = (points, colour, width, dash) => scene.locus(points, colour, front, width, dash, 0.6);
    line(exact, colours.other, small ? 1.25 : 1.75);
    line(found, colours.method, small ? 1.25 : 2);
    line(angles, colours.error, 1.25, [5, 5]);
  };
  loci(false);
  const [w, x, y, z] = run.truth.q[at];
  drawBody(scene, { w, x, y, z }, colours);
  loci(true);
  if (!small) {
    scene.arrow(run.truth.momentum[at], colours.y, 2.5);
    scene.arrow(run.truth.rate[at], colours.rate, 2.5);
  }
  scene.label([]);
  const dot = (v, colour, radius) => {
    const [cx, cy] = scene.project(v);
    scene.context.fillStyle = colour;
    scene.context.beginPath();
    scene.context.arc(cx, cy, radius, 0, 2 * Math.PI);
    scene.context.fill();
  };
  dot(exact.at(-1), colours.other, small ? 3 : 4);
  if (found.length) dot(found.at(-1), colours.method, small ? 3 : 4);
  return { axis: exact.at(-1), found: found.at(-1) };
}

const LEFT = 54;
const RIGHT = 10;
const TOP = 8;
const BOTTOM = 20;

// Largest errors between instants, on a logarithmic scale; `at` is the time of the cursor.
export function drawErrors(surface, colours, strokes, run, at) {
  const context = surface.begin();
  const [width, height] = [surface.width - LEFT - RIGHT, surface.height - TOP - BOTTOM];
  const end = run.t.at(-1);
  let [low, high] = [Infinity, -Infinity];
  for (const { error_deg } of run.methods) {
    for (const error of error_deg) {
      if (error > 0 && error < low) low = error;
      if (error > high) high = error;
    }
  }
  if (!(high > 0)) [low, high] = [1e-12, 1];
  const [from, to] = [Math.max(-16, Math.floor(Math.log10(low))), Math.ceil(Math.log10(high) + 1e-9)];
  const decades = Math.max(1, to - from);
  const yOf = (error) => TOP + (1 - (Math.log10(Math.max(error, 10 ** from)) - from) / decades) * height;
  const xOf = (t) => LEFT + (t / end) * width;
  context.font = `11px ${FONT}`;
  context.lineWidth = 1;
  context.textBaseline = "middle";
  const every = Math.ceil(decades / Math.max(1, height / 24));
  for (let decade = from; decade <= to; decade += every) {
    const y = Math.round(yOf(10 ** decade)) + 0.5;
    context.strokeStyle = colours.grid;
    context.beginPath();
    context.moveTo(LEFT, y);
    context.lineTo(LEFT + width, y);
    context.stroke();
    context.fillStyle = colours.muted;
    context.textAlign = "right";
    context.fillText(
      decade >= -2 && decade <= 3 ? String(Number((10 ** decade).toPrecision(1))) : `1e${decade}`.replace("-", "−"),
      LEFT - 6, y,
    );
  }
  context.textAlign = "center";
  for (let tenth = 0; tenth <= 4; tenth++) {
    const t = (end * tenth) / 4;
    context.fillText(`${Number(t.toFixed(3))} s`, Math.max(LEFT + 6, Math.min(LEFT + width - 14, xOf(t))), TOP + height + 12);
  }
  run.methods.forEach(({ error_deg }, n) => {
    context.strokeStyle = strokes[n];
    context.lineWidth = n === 0 ? 2 : 1.4;
    context.beginPath();
    trace(context, run.t, error_deg, xOf, yOf);
    context.stroke();
  });
  context.strokeStyle = colours.muted;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(xOf(at), TOP);
  context.lineTo(xOf(at), TOP + height);
  context.stroke();
  context.strokeStyle = colours.line;
  context.strokeRect(LEFT + 0.5, TOP + 0.5, width - 1, height - 1);
}

// Least and greatest of each column of pixels.
function trace(context, times, values, xOf, yOf) {
  let [column, low, high, drawing] = [NaN, 0, 0, false];
  const flush = () => {
    if (Number.isNaN(column)) return;
    if (drawing) context.lineTo(column, yOf(low));
    else context.moveTo(column, yOf(low));
    if (high !== low) context.lineTo(column, yOf(high));
    drawing = true;
  };
  values.forEach((value, n) => {
    // Where nothing has happened yet there is no error to draw.
    if (value <= 0) return;
    const at = Math.floor(xOf(times[n])) + 0.5;
    if (at !== column) {
      flush();
      [column, low, high] = [at, value, value];
    }
    low = Math.min(low, value);
    high = Math.max(high, value);
  });
  flush();
}
