// Lines over time. Within one column of pixels only the least and the greatest value are drawn: no
// peak that came is lost, and a line has at most two points a column.

import { FONT } from "./surface.js";

const LEFT = 52;
const RIGHT = 8;
const TOP = 6;
const BOTTOM = 18;
// Longest step without a break, in ordinary steps.
const HOLE = 12;

// Round steps of a scale from `low` to `high`.
export function ticks(low, high, most) {
  const rough = (high - low) / most;
  const size = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((n) => n * size).find((s) => s >= rough * 0.999) ?? 10 * size;
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return { step, at: Array.from({ length: Math.max(0, last - first + 1) }, (_, n) => (first + n) * step) };
}

export function spoken(value, step) {
  const digits = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
  const text = Math.abs(value) >= 1e5 ? value.toExponential(1) : value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
}

// Least and greatest of the series from number `from` on.
function range(history, series, from) {
  let [low, high] = [Infinity, -Infinity];
  for (const values of series) {
    for (let n = from; n < history.total; n++) {
      const value = values[history.slot(n)];
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return [low, high];
}

// A scale that does not shrink at once when a peak has left.
export class Scale {
  constructor(least) {
    this.least = least;
    this.reset();
  }

  reset() {
    this.low = NaN;
    this.high = NaN;
  }

  // An angle that goes around fills its circle at most.
  follow(low, high, wraps) {
    if (wraps && high - low > 150) {
      [this.low, this.high] = [-180, 180];
      return;
    }
    if (!(high >= low)) [low, high] = [-this.least / 2, this.least / 2];
    const room = Math.max(this.least - (high - low), (high - low) * 0.12, 0) / 2;
    const { at, step } = ticks(low - room, high + room, 4);
    const [from, to] = [Math.min(low - room, at[0] ?? low), Math.max(high + room, at.at(-1) ?? high)];
    const fits = from >= this.low - step && to <= this.high + step && low >= this.low && high <= this.high;
    const wasteful = this.high - this.low === 360 || this.high - this.low > 2.5 * (to - from);
    if (!fits || wasteful) [this.low, this.high] = [from, to];
  }
}

// series: arrays of a History; `wraps` breaks the line where an angle turns over.
export function drawPlot(surface, colours, history, plot) {
  const { series, strokes, seconds, scale, wraps } = plot;
  const context = surface.begin();
  const [width, height] = [surface.width - LEFT - RIGHT, surface.height - TOP - BOTTOM];
  if (width < 10 || height < 10) return 0;
  const end = history.total ? history.newestTime : 0;
  const start = end - seconds;
  const from = history.firstFrom(start);
  scale.follow(...range(history, series, from), wraps);
  const { low, high } = scale;
  const first = history.total ? history.timeOf(history.oldest) - 1e-9 : NaN;
  const xOf = (time) => LEFT + ((time - start) / seconds) * width;
  const yOf = (value) => TOP + (1 - (value - low) / (high - low)) * height;

  frame(context, colours, { low, high, start, end, first, width, height, xOf, yOf });
  context.save();
  context.beginPath();
  context.rect(LEFT, 0, width + RIGHT, surface.height);
  context.clip();
  let points = 0;
  const count = history.total - from;
  const usual = count > 1 ? (end - history.timeOf(from)) / (count - 1) : Infinity;
  series.forEach((values, n) => {
    context.strokeStyle = strokes[n];
    context.lineWidth = 1.4;
    context.beginPath();
    points += trace(context, history, values, { from, xOf, yOf, wraps, hole: HOLE * usual });
    context.stroke();
  });
  context.restore();
  return points;
}

function trace(context, history, values, { from, xOf, yOf, wraps, hole }) {
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
  for (let n = from; n < history.total; n++) {
    const slot = history.slot(n);
    const [value, time] = [values[slot], history.time[slot]];
    const cut = history.broken[slot] || time - timeBefore > hole || (wraps && Math.abs(value - before) > 180);
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

function frame(context, colours, { low, high, start, end, first, width, height, xOf, yOf }) {
  context.font = `11px ${FONT}`;
  context.fillStyle = colours.muted;
  context.strokeStyle = colours.grid;
  context.lineWidth = 1;
  context.textAlign = "right";
  context.textBaseline = "middle";
  const across =
    high - low === 360
      ? { step: 90, at: [-180, -90, 0, 90, 180] }
      : ticks(low, high, Math.max(2, Math.min(5, height / 26)));
  for (const value of across.at) {
    const y = Math.round(yOf(value)) + 0.5;
    context.beginPath();
    context.moveTo(LEFT, y);
    context.lineTo(LEFT + width, y);
    context.stroke();
    context.fillText(spoken(value, across.step), LEFT - 6, y);
  }
  context.textBaseline = "alphabetic";
  const along = ticks(start, end, Math.max(2, Math.min(6, width / 70)));
  for (const time of along.at) {
    if (!(time >= first)) continue;
    const x = Math.round(xOf(time)) + 0.5;
    context.beginPath();
    context.moveTo(x, TOP);
    context.lineTo(x, TOP + height);
    context.stroke();
    if (x > LEFT + 8 && x < LEFT + width - 8) {
      context.textAlign = "center";
      context.fillText(`${spoken(time, along.step)} s`, x, TOP + height + 13);
    }
  }
  context.strokeStyle = colours.line;
  context.strokeRect(LEFT + 0.5, TOP + 0.5, width - 1, height - 1);
}
