// Lines over time. Within one column of pixels only the least and the greatest value are drawn: no
// peak that came is lost, and a line has at most two points a column.

import { clockTime } from "./clock.js";
import { fixed } from "./numbers.js";
import { digitsOf, spoken, ticks } from "./scale.js";
import { FONT } from "./surface.js";

// Pixels around the lines.
export const EDGES = { left: 52, right: 8, top: 6, bottom: 18 };
// Longest step without a break, in ordinary steps.
const HOLE = 12;
// Pixels from the cursor to a sample that is told.
const NEAR = 12;
// Pixels between samples from which on each is marked.
const SPACED = 9;

// The part of each line that is drawn, and one instant beyond on both sides.
function parts(lines, from, to) {
  return lines.map((line) => {
    const { track } = line;
    const [first, beyond] = [track.firstFrom(from), track.firstFrom(to)];
    const begin = Math.max(track.oldest, first - 1);
    // Where none is inside, nor one on each side, there is nothing.
    const isEmpty = first === beyond && (first === track.oldest || first === track.total) && track.timeOf(first) !== to;
    const end = isEmpty ? begin : Math.min(track.total, beyond + 2);
    const count = end - begin;
    const usual = count > 1 ? (track.timeOf(end - 1) - track.timeOf(begin)) / (count - 1) : Infinity;
    return { ...line, begin, end, usual };
  });
}

// Least and greatest of what is drawn.
function range(drawn) {
  let [low, high] = [Infinity, -Infinity];
  for (const { track, values, begin, end } of drawn) {
    for (let n = begin; n < end; n++) {
      const value = values[track.slot(n)];
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return [low, high];
}

// lines: { track, values, colour, name, dash }; `wraps` breaks a line where an angle turns over. Says how many points it
// drew and what there is at the cursor: { number, time, values }, or null.
export function drawPlot(surface, colours, lines, { span: [from, to], scale, wraps, cursor = NaN, selected }) {
  const context = surface.begin();
  const [width, height] = [surface.width - EDGES.left - EDGES.right, surface.height - EDGES.top - EDGES.bottom];
  if (width < 10 || height < 10) return { points: 0, at: null };
  const drawn = parts(lines, from, to);
  const seen = range(drawn);
  scale.follow(...seen, wraps);
  const { low, high } = scale;
  const xOf = (time) => EDGES.left + ((time - from) / (to - from)) * width;
  const yOf = (value) => EDGES.top + (1 - (value - low) / (high - low)) * height;
  const place = { lines, low, high, from, to, width, height, xOf, yOf };
  place.isEmpty = !(seen[1] >= seen[0]);
  place.first = Math.min(...lines.map(({ track }) => track.oldestTime)) - 1e-9;
  place.last = Math.max(...lines.map(({ track }) => track.newestTime)) + 1e-9;

  frame(context, colours, place);
  context.save();
  context.beginPath();
  context.rect(EDGES.left, 0, width + EDGES.right, surface.height);
  context.clip();
  if (selected) {
    context.fillStyle = colours.other;
    context.globalAlpha = 0.14;
    context.fillRect(xOf(selected[0]), EDGES.top, xOf(selected[1]) - xOf(selected[0]), height);
    context.globalAlpha = 1;
  }
  let points = 0;
  for (const line of drawn) {
    context.strokeStyle = context.fillStyle = line.colour;
    context.lineWidth = 1.4;
    context.setLineDash(line.dash ?? []);
    context.beginPath();
    points += trace(context, line, { xOf, yOf, wraps });
    context.stroke();
    context.setLineDash([]);
    if ((line.usual / (to - from)) * width > SPACED) mark(context, line, xOf, yOf);
  }
  const at = cursor >= from && cursor <= to ? look(drawn, cursor, ((to - from) / width) * NEAR) : null;
  if (cursor >= from && cursor <= to) drawCursor(context, colours, place, cursor, at);
  context.restore();
  return { points, at };
}

function trace(context, { track, values, begin, end, usual }, { xOf, yOf, wraps }) {
  const hole = HOLE * usual;
  let points = 0;
  let column = NaN;
  let [low, high, first, last] = [0, 0, 0, 0];
  let drawing = false;
  let [before, timeBefore] = [NaN, NaN];
  const flush = () => {
    if (Number.isNaN(column)) return;
    const rising = last >= first;
    const [one, two] = rising ? [low, high] : [high, low];
    if (drawing) context.lineTo(column + 0.5, yOf(one));
    else context.moveTo(column + 0.5, yOf(one));
    points++;
    if (two !== one || !drawing) {
      context.lineTo(column + 0.5, yOf(two));
      points++;
    }
    drawing = true;
    column = NaN;
  };
  for (let n = begin; n < end; n++) {
    const slot = track.slot(n);
    const [value, time] = [values[slot], track.time[slot]];
    const cut = track.broken[slot] || time - timeBefore > hole || (wraps && Math.abs(value - before) > 180);
    if (cut || Number.isNaN(value)) {
      flush();
      drawing = false;
    }
    [before, timeBefore] = [value, time];
    if (Number.isNaN(value)) continue;
    const at = Math.floor(xOf(time));
    if (at !== column) {
      flush();
      column = at;
      [low, high, first] = [value, value, value];
    }
    if (value < low) low = value;
    if (value > high) high = value;
    last = value;
  }
  flush();
  return points;
}

function mark(context, { track, values, begin, end }, xOf, yOf) {
  context.beginPath();
  for (let n = begin; n < end; n++) {
    const value = values[track.slot(n)];
    if (Number.isNaN(value)) continue;
    const [x, y] = [Math.floor(xOf(track.timeOf(n))) + 0.5, yOf(value)];
    context.moveTo(x + 2, y);
    context.arc(x, y, 2, 0, 2 * Math.PI);
  }
  context.fill();
}

// What each line was at the sample nearest to `time`; null where none is near.
function look(drawn, time, near) {
  const values = drawn.map(({ track, values: of, usual }) => {
    const number = track.nearest(time, Math.max(near, Number.isFinite(usual) ? usual * 0.6 : 0));
    return number < 0 ? null : { number, value: of[track.slot(number)], time: track.timeOf(number) };
  });
  const some = values.find((v) => v && !Number.isNaN(v.value));
  return some ? { number: some.number, time: some.time, values: values.map((v) => v?.value ?? NaN) } : null;
}

function drawCursor(context, colours, place, cursor, at) {
  const { low, high, from, to, width, height, xOf, yOf } = place;
  const x = Math.round(xOf(cursor)) + 0.5;
  context.strokeStyle = colours.muted;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(x, EDGES.top);
  context.lineTo(x, EDGES.top + height);
  context.stroke();
  const digits = digitsOf((to - from) / width, 6);
  const told = [[clockTime(cursor, Math.max(1, digits)), colours.text]];
  const step = (high - low) / height;
  context.font = `11px ${FONT}`;
  for (const [n, value] of (at?.values ?? []).entries()) {
    if (Number.isNaN(value)) continue;
    const { colour, name } = place.lines[n];
    context.fillStyle = colour;
    context.beginPath();
    context.arc(xOf(at.time), yOf(value), 3, 0, 2 * Math.PI);
    context.fill();
    if (name) told.push([`${name} ${fixed(value, digitsOf(step / 20))}`, colour]);
  }
  if (!at) told.push(["no data", colours.muted]);
  box(context, colours, x, told, place);
}

// Beside the cursor, on the side where there is room.
function box(context, colours, x, told, { width, height }) {
  const wide = Math.max(...told.map(([text]) => context.measureText(text).width)) + 12;
  const high = 14 * told.length + 6;
  const left = x + 8 + wide < EDGES.left + width ? x + 8 : x - 8 - wide;
  const top = EDGES.top + Math.min(6, Math.max(0, height - high));
  context.globalAlpha = 0.88;
  context.fillStyle = colours.surface;
  context.fillRect(left, top, wide, high);
  context.globalAlpha = 1;
  context.strokeStyle = colours.line;
  context.strokeRect(Math.round(left) + 0.5, top + 0.5, Math.round(wide), high);
  context.textAlign = "left";
  context.textBaseline = "middle";
  told.forEach(([text, colour], n) => {
    context.fillStyle = colour;
    context.fillText(text, left + 6, top + 10.5 + 14 * n);
  });
}

function frame(context, colours, { low, high, from, to, first, last, isEmpty, width, height, xOf, yOf }) {
  context.font = `11px ${FONT}`;
  context.fillStyle = colours.muted;
  context.strokeStyle = colours.grid;
  context.lineWidth = 1;
  const [left, bottom] = [EDGES.left, EDGES.top + height];
  context.textAlign = "right";
  context.textBaseline = "middle";
  const across =
    high - low === 360
      ? { step: 90, at: [-180, -90, 0, 90, 180] }
      : ticks(low, high, Math.max(2, Math.min(5, height / 26)));
  // A scale of nothing says nothing.
  for (const value of isEmpty ? [] : across.at) {
    const y = Math.round(yOf(value)) + 0.5;
    context.beginPath();
    context.moveTo(left, y);
    context.lineTo(left + width, y);
    context.stroke();
    context.fillText(spoken(value, across.step), left - 6, y);
  }
  context.textBaseline = "alphabetic";
  context.textAlign = "center";
  const along = ticks(from, to, Math.max(2, Math.min(6, width / 80)), { isTime: true });
  for (const time of along.at) {
    if (!(time >= first && time <= last)) continue;
    const x = Math.round(xOf(time)) + 0.5;
    context.beginPath();
    context.moveTo(x, EDGES.top);
    context.lineTo(x, bottom);
    context.stroke();
    if (x > left + 14 && x < left + width - 14) {
      context.fillText(clockTime(time, Math.max(1, digitsOf(along.step))), x, bottom + 13);
    }
  }
  if (isEmpty) context.fillText("no data here", left + width / 2, EDGES.top + height / 2 + 4);
  context.strokeStyle = colours.line;
  context.strokeRect(left + 0.5, EDGES.top + 0.5, width - 1, height - 1);
}
