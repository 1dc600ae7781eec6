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

// Number of the circle that an angle without jumps is in.
const circle = (angle) => Math.floor((angle + 180) / 360);

// Least and greatest of what is drawn. Of angles without jumps those within their circle; more than one are the whole.
function range(drawn, wraps) {
  let [low, high] = [Infinity, -Infinity];
  for (const { track, values, lows = values, highs = values, begin, end } of drawn) {
    for (let n = begin; n < end; n++) {
      const slot = track.slot(n);
      let [least, most] = [lows[slot], highs[slot]];
      if (wraps && lows !== values) {
        const turns = circle(least);
        if (circle(most) !== turns) return [-180, 180];
        [least, most] = [least - 360 * turns, most - 360 * turns];
      }
      if (least < low) low = least;
      if (most > high) high = most;
    }
  }
  return [low, high];
}

// Draws a line; one of an angle ends at one border of its circle and goes on at the other.
class Pen {
  constructor(context, yOf, wraps) {
    Object.assign(this, { context, yOf, wraps });
  }

  moveTo(x, value) {
    [this.x, this.value] = [x, value];
    this.context.moveTo(x, this.yOf(this.wraps ? value - 360 * circle(value) : value));
  }

  lineTo(x, value) {
    const { context, yOf } = this;
    if (this.wraps) {
      let now = circle(this.value);
      const end = circle(value);
      if (Math.abs(end - now) > 1) {
        // More than a whole rotation in a column fills it.
        context.moveTo(x, yOf(-180));
        context.lineTo(x, yOf(180));
        now = end;
        context.moveTo(x, yOf(value - 360 * end));
      }
      if (now !== end) {
        const up = end > now;
        const border = 360 * Math.max(now, end) - 180;
        const at = this.x + ((border - this.value) / (value - this.value)) * (x - this.x);
        context.lineTo(at, yOf(up ? 180 : -180));
        context.moveTo(at, yOf(up ? -180 : 180));
      }
      context.lineTo(x, yOf(value - 360 * end));
    } else {
      context.lineTo(x, yOf(value));
    }
    [this.x, this.value] = [x, value];
  }
}

// lines: { track, values, colour, name, dash }, of stretches { lows, highs } as well; `wraps`: angles, which go around;
// `head`: the instant that is played. Says how many points it drew and what there is at the cursor: { number, time,
// values }, or null.
export function drawPlot(surface, colours, lines, { span: [from, to], scale, wraps, cursor = NaN, head = NaN, marks = [], selected }) {
  const context = surface.begin();
  const [width, height] = [surface.width - EDGES.left - EDGES.right, surface.height - EDGES.top - EDGES.bottom];
  if (width < 10 || height < 10) return { points: 0, at: null };
  const drawn = parts(lines, from, to);
  const seen = range(drawn, wraps);
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
  for (const time of marks) if (time >= from && time <= to) drawMark(context, colours, place, time);
  if (head >= from && head <= to) drawHead(context, colours, place, head);
  const at = cursor >= from && cursor <= to ? look(drawn, cursor, ((to - from) / width) * NEAR) : null;
  if (cursor >= from && cursor <= to) drawCursor(context, colours, place, cursor, at);
  context.restore();
  return { points, at };
}

function trace(context, { track, values, lows, highs, begin, end, usual }, { xOf, yOf, wraps }) {
  const hole = HOLE * usual;
  const pen = new Pen(context, yOf, wraps);
  let points = 0;
  let column = NaN;
  let [low, high, first, last] = [0, 0, 0, 0];
  let drawing = false;
  let [before, timeBefore] = [NaN, NaN];
  const flush = () => {
    if (Number.isNaN(column)) return;
    const rising = last >= first;
    const [one, two] = rising ? [low, high] : [high, low];
    if (drawing) pen.lineTo(column + 0.5, one);
    else pen.moveTo(column + 0.5, one);
    points++;
    if (two !== one || !drawing) {
      pen.lineTo(column + 0.5, two);
      points++;
    }
    drawing = true;
    column = NaN;
  };
  for (let n = begin; n < end; n++) {
    const slot = track.slot(n);
    const time = track.time[slot];
    let [least, most] = lows ? [lows[slot], highs[slot]] : [values[slot], values[slot]];
    // An angle that comes goes around by the shorter way.
    const turns = wraps && !lows && Math.round((before - least) / 360);
    if (turns) least = most = least + 360 * turns;
    const value = (least + most) / 2;
    const cut = track.broken[slot] || time - timeBefore > hole;
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
      [low, high, first] = [least, most, value];
    }
    if (least < low) low = least;
    if (most > high) high = most;
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

// Where a reference was set anew by its source: it has another world from there on.
function drawMark(context, colours, { height, xOf }, time) {
  const x = Math.round(xOf(time)) + 0.5;
  context.strokeStyle = context.fillStyle = colours.muted;
  context.lineWidth = 1;
  context.setLineDash([2, 3]);
  context.beginPath();
  context.moveTo(x, EDGES.top);
  context.lineTo(x, EDGES.top + height);
  context.stroke();
  context.setLineDash([]);
  context.font = `11px ${FONT}`;
  context.textAlign = "left";
  context.textBaseline = "top";
  context.fillText("reset", x + 3, EDGES.top + 3);
}

// Where the recording is that is played.
function drawHead(context, colours, { height, xOf }, head) {
  const x = Math.round(xOf(head)) + 0.5;
  context.strokeStyle = colours.other;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(x, EDGES.top);
  context.lineTo(x, EDGES.top + height);
  context.stroke();
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
