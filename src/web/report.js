// The charts of a report, to be looked into: drawn from the numbers beside each. Without this the pictures stand.

import { clockTime } from "./clock.js";
import { fixed } from "./numbers.js";
import { drawPlot } from "./plot.js";
import { digitsOf, Scale } from "./scale.js";
import { Surface } from "./surface.js";
import { TimeView } from "./timeview.js";
import { Track } from "./track.js";

const INKS = { surface: "paper", text: "ink", muted: "dim", line: "line", grid: "line", other: "dim" };

function inks() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  const named = Object.fromEntries(Object.entries(INKS).map(([name, variable]) => [name, of(variable)]));
  return { ...named, lines: Array.from({ length: 8 }, (_, n) => of(`c${n}`)) };
}

const made = (tag, text, under) => {
  const element = document.createElement(tag);
  element.textContent = text;
  under.append(element);
  return element;
};

class Picture {
  constructor(figure, data, clock) {
    this.clock = clock;
    this.data = data;
    this.scale = new Scale(1e-6);
    this.lines = data.lines.map(({ name, color, dashed, t, v, breaks }) => {
      const track = new Track(Float64Array.from(t));
      for (const at of breaks) track.broken[at] = 1;
      const values = Float64Array.from(v, (value) => value ?? NaN);
      return { track, values, name, color, dash: dashed ? [5, 4] : [] };
    });
    clock.whole[1] = Math.max(clock.whole[1], ...this.lines.map(({ track }) => track.newestTime || 0));
    this.caption = made("figcaption", "", figure);
    made("b", data.title, this.caption);
    this.keys = this.lines.filter(({ name }) => name).map((line) => [line, made("i", line.name, this.caption)]);
    this.canvas = made("canvas", "", figure);
    for (const [name, value] of [["role", "slider"], ["tabindex", "0"], ["aria-label", `${data.title} over time`]]) {
      this.canvas.setAttribute(name, value);
    }
    figure.classList.add("looked");
    // The canvas takes the keys.
    figure.removeAttribute("tabindex");
    this.surface = new Surface(this.canvas, soon);
    view.attach(this.canvas, { clock: () => clock, span: () => view.span(clock, clock.whole[1]) });
  }

  draw(colours) {
    const { top, bottom } = this.canvas.getBoundingClientRect();
    // What is out of sight is drawn once, and again when it comes in sight.
    if (this.isDrawn && (bottom < 0 || top > innerHeight)) return;
    this.isDrawn = true;
    const span = view.span(this.clock, this.clock.whole[1]);
    const lines = this.lines.map((line) => ({ ...line, name: line.name || "", colour: colours.lines[line.color % 8] }));
    for (const [line, key] of this.keys) key.style.borderColor = colours.lines[line.color % 8];
    const cursor = view.cursor(this.clock);
    const selected = view.selection(this.clock);
    const { at } = drawPlot(this.surface, colours, lines, { span, scale: this.scale, wraps: this.data.wraps, cursor, selected });
    const digits = digitsOf((this.scale.high - this.scale.low) / 2000);
    const told = this.lines.flatMap(({ name }, n) => (name && at ? [`${name} ${fixed(at.values[n], digits)}`] : []));
    const when = at ? at.time : Number.isFinite(cursor) ? cursor : span[1];
    const set = (name, value) => this.canvas.setAttribute(`aria-value${name}`, value);
    set("min", span[0].toFixed(3));
    set("max", span[1].toFixed(3));
    set("now", Math.max(span[0], Math.min(span[1], when)).toFixed(3));
    set("text", `${clockTime(when, 3)}: ${told.join(", ") || "no cursor"}`);
  }
}

const pictures = [];
let waits = false;
function drawAll() {
  waits = false;
  const colours = inks();
  for (const picture of pictures) picture.draw(colours);
}

function soon() {
  if (!waits) requestAnimationFrame(drawAll);
  waits = true;
}

const view = new TimeView(10, soon);
const clocks = new Map();
for (const block of document.querySelectorAll("script.lines")) {
  const section = block.closest("section");
  if (!clocks.has(section)) clocks.set(section, { whole: [0, 0], newest: 0 });
  pictures.push(new Picture(block.closest("figure"), JSON.parse(block.textContent), clocks.get(section)));
}
addEventListener("keydown", (event) => event.key === "Escape" && view.home());
addEventListener("scroll", soon, { passive: true });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", soon);
window.__report = { view, pictures };
drawAll();
