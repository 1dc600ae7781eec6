// The interactive top: choices -> what the daemon works out -> an animation.

import { Camera, steer } from "./body3d.js";
import { fixed, say } from "./numbers.js";
import { palette, Surface } from "./surface.js";
import { drawErrors, drawTop } from "./topview.js";

const CLASSIC = ["cusped", "wavy", "looping", "steady-slow"];
const WORDS = {
  cusped: "let go but for its spin",
  wavy: "pushed with half the slow precession",
  looping: "pushed backwards",
  "steady-slow": "pushed with the slow precession",
};
const HINTS = {
  cusped: "Let go at rest but for its spin: the axis falls and rises, its path has cusps.",
  wavy: "Pushed with half the slow precession: its path waves and never turns back.",
  looping: "Pushed backwards with the slow precession: its path makes loops.",
  "steady-slow": "Pushed with the slow precession: no nutation.",
  "steady-fast": "The fast precession: nearly a free top.",
  sleeping: "Upright: it stays so above a certain spin.",
  falling: "Too little spin: it tips over.",
  free: "Tilt and rates as given, in z-x′-z″ angles.",
};
const FRAME = 1000 / 30;
const FIELDS = ["spin_hz", "tilt_deg", "rate_hz", "duration"];

const parts = {};
for (const part of document.querySelectorAll("[data-page]")) parts[part.dataset.page] = part;
const { form } = parts;
const parameters = new URLSearchParams(location.search);
for (const [name, value] of parameters) {
  const field = form.elements.namedItem(name);
  if (field && (field.tagName !== "SELECT" || [...field.options].some((o) => o.value === value))) field.value = value;
}
const frozen = parameters.get("frozen") === "1";

let colours = palette();
const camera = new Camera();
const stage = new Surface(parts.stage, () => draw());
const plot = new Surface(parts.errors, () => draw());
let [run, time, playing, dirty] = [null, 0, !frozen, true];
const four = CLASSIC.map((name) => {
  const button = document.createElement("button");
  button.type = "button";
  button.dataset.testid = `case-${name}`;
  const canvas = document.createElement("canvas");
  canvas.setAttribute("aria-hidden", "true");
  const [title, words, error] = ["b", "span", "span"].map((kind) => document.createElement(kind));
  title.textContent = name;
  words.textContent = WORDS[name];
  button.append(canvas, title, words, error);
  parts.four.append(button);
  button.addEventListener("click", () => {
    form.elements.case.value = name;
    ask();
  });
  return { name, error, button, surface: new Surface(canvas, () => draw()), run: null };
});

// What programs see.
window.__strapd = { state: "asking", run: null, asked: 0 };

function strokes() {
  const of = { "euler-angles": colours.error, auto: colours.y };
  return (run?.methods ?? []).map((method, n) => (n === 0 ? colours.method : (of[method.name] ?? colours.other)));
}

function wanted(name) {
  const values = Object.fromEntries(FIELDS.map((field) => [field, form.elements[field].value]));
  const chosen = form.elements.method.value;
  const query = new URLSearchParams({ case: name, ...values });
  if (name === "free") {
    for (const field of ["precession_dps", "nutation_dps"]) query.set(field, form.elements[field].value);
  }
  const upright = name === "sleeping" || [0, 180].includes(Number(values.tilt_deg));
  const methods = new Set([chosen, "euler-angles", "auto"]);
  if (upright && chosen !== "euler-angles") methods.delete("euler-angles");
  return { query, methods: [...methods] };
}

async function fetched(name, { all = true, points = 1000 } = {}, signal) {
  const { query, methods } = wanted(name);
  const headers = {};
  const token = sessionStorage.getItem("token");
  if (token) headers.Authorization = `Bearer ${token}`;
  query.set("points", String(points));
  let list = all ? methods : methods.slice(0, 1);
  for (;;) {
    query.set("methods", list.join(","));
    const answer = await fetch(`/model/top?${query}`, { headers, signal });
    const found = await answer.json();
    if (answer.ok) return found;
    // The Euler angles may run into the vertical on the way: then without them.
    const without = list.filter((method) => method !== "euler-angles");
    if (answer.status === 400 && /^euler-angles:/.test(found.message) && list[0] !== "euler-angles" && without.length < list.length) {
      list = without;
      continue;
    }
    const help = answer.status === 401 ? " (the live page asks for the token)" : "";
    throw new Error(`${found.message ?? answer.statusText}${help}`);
  }
}

let asking = null;
async function ask() {
  asking?.abort();
  asking = new AbortController();
  const { signal } = asking;
  const name = form.elements.case.value;
  parts.free.hidden = parts.free2.hidden = name !== "free";
  say(parts.hint, HINTS[name] ?? "");
  for (const each of four) each.button.setAttribute("aria-pressed", String(each.name === name));
  if (!form.checkValidity()) return problem("a value is outside its bounds");
  state("connecting", "working it out");
  try {
    const found = await fetched(name, {}, signal);
    run = found;
    time = frozen ? found.t.at(-1) : 0;
    dirty = true;
    told();
    problem("");
    window.__strapd.run = found;
    await Promise.all(
      four.map(async (each) => {
        try {
          each.run = await fetched(each.name, { all: false, points: 500 }, signal);
          const worst = Object.values(each.run.errors_deg)[0];
          say(each.error, `${Object.keys(each.run.errors_deg)[0]}: ${short(worst.attitude_max)}° off at most`);
        } catch (error) {
          if (signal.aborted) throw error;
          each.run = null;
          say(each.error, error.message);
        }
        dirty = true;
      }),
    );
    draw();
    state("open", "computed");
    window.__strapd.asked++;
  } catch (error) {
    if (!signal.aborted) problem(error.message);
  }
}

function state(name, words) {
  window.__strapd.state = name;
  parts.state.dataset.state = name;
  say(parts.state, words);
}

function problem(text) {
  parts.problem.hidden = text === "";
  say(parts.problem, text);
  if (text) state("closed", "not computed");
}

function short(value) {
  if (value === 0) return "0";
  return value >= 1e-3 && value < 1000 ? String(Number(value.toPrecision(3))) : value.toExponential(2).replace("e-", "e−");
}

function told() {
  const colour = strokes();
  parts.rows.replaceChildren(
    ...run.methods.map(({ name }, n) => {
      const row = document.createElement("tr");
      const head = document.createElement("th");
      head.scope = "row";
      const swatch = document.createElement("i");
      swatch.className = "swatch";
      swatch.style.borderColor = colour[n];
      head.append(swatch, name);
      row.append(head);
      for (const part of ["axis_max", "attitude_max"]) {
        const cell = document.createElement("td");
        const data = document.createElement("data");
        data.value = String(run.errors_deg[name][part]);
        data.dataset.testid = `${part}-${name}`;
        data.textContent = short(run.errors_deg[name][part]);
        cell.append(data);
        row.append(cell);
      }
      return row;
    }),
  );
  const [least, most] = run.nutation_deg;
  say(parts.facts, `Axis between ${fixed(least, 2)}° and ${fixed(most, 2)}° from the vertical. Sleeps upright above ${fixed(run.sleeps_above_hz, 2)} turns/s.`);
  say(parts.legendMethod, run.methods[0]?.name ?? "method");
  parts.legendEuler.hidden = !run.methods.some((m, n) => n > 0 && m.name === "euler-angles");
  parts.slider.max = String(run.t.at(-1));
}

// Number of the last instant not after `time`.
function instant(of) {
  let [low, high] = [0, of.t.length - 1];
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (of.t[middle] <= time + 1e-9) low = middle;
    else high = middle - 1;
  }
  return low;
}

function draw() {
  if (run) {
    window.__strapd.drawn = drawTop(stage, camera, colours, run, instant(run));
    drawErrors(plot, colours, strokes(), run, time);
    parts.slider.value = String(time);
    say(parts.clock, `${fixed(time, 3)} s`);
    parts.stage.setAttribute("aria-label", `The top, case ${run.case}, at ${fixed(time, 2)} seconds`);
  }
  for (const each of four ?? []) {
    if (each.run) drawTop(each.surface, camera, colours, each.run, instant(each.run), { small: true });
  }
}

let drawnAt = 0;
function tick(now) {
  requestAnimationFrame(tick);
  const step = now - drawnAt;
  if (step < FRAME - 4) return;
  drawnAt = now;
  if (playing && run) {
    time += (Math.min(step, 100) / 1000) * Number(parts.speed.value);
    if (time > run.t.at(-1)) time = 0;
    dirty = true;
  }
  if (!dirty) return;
  dirty = false;
  draw();
}

function play(on) {
  playing = on;
  say(parts.play, on ? "Pause" : "Play");
  parts.play.setAttribute("aria-pressed", String(on));
}

let soon;
form.addEventListener("input", () => {
  clearTimeout(soon);
  soon = setTimeout(ask, 250);
});
form.addEventListener("submit", (event) => event.preventDefault());
parts.play.addEventListener("click", () => play(!playing));
parts.slider.addEventListener("input", () => {
  play(false);
  time = Number(parts.slider.value);
  dirty = true;
});
steer(parts.stage, camera, () => (dirty = true));
document.addEventListener("keydown", (event) => {
  if (event.key !== " " || /^(INPUT|SELECT|BUTTON)$/.test(event.target.tagName)) return;
  event.preventDefault();
  play(!playing);
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  colours = palette();
  if (run) told();
  dirty = true;
});
play(playing);
ask();
requestAnimationFrame(tick);
