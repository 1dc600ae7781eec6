// The live page: messages -> sensors -> at most 30 pictures a second.

import { Camera, Scene } from "./body3d.js";
import { demonstration, LAST } from "./demonstration.js";
import { Link } from "./link.js";
import { say, whole } from "./numbers.js";
import { Playback } from "./playback.js";
import { rollPitchYaw } from "./quaternion.js";
import { Sensor, taken } from "./sensor.js";
import { palette, Surface } from "./surface.js";

// Attitudes a second asked for in all, shared among the sensors shown: every sample of one at
// 1 kHz, and of an 8 kHz one every eighth.
const BUDGET = 1000;
// Asked for while nobody looks.
const HIDDEN_HZ = 2;
const MOST_SENSORS = 8;
const FRAME = 1000 / 30;
const WINDOWS = [2, 5, 10, 30];

const parameters = new URLSearchParams(location.search);
const only = parameters.get("ids")?.split(",").filter(Boolean);
const frozen = parameters.get("frozen") === "1";
const stopAt = parameters.has("seq") ? Number(parameters.get("seq")) : null;
const asked = Number(parameters.get("rate_hz"));

const parts = {};
for (const part of document.querySelectorAll("[data-page]")) parts[part.dataset.page] = part;

const sensors = new Map();
const left = new Set();
let [paused, still] = [false, false];
let seconds = WINDOWS.includes(Number(parameters.get("window"))) ? Number(parameters.get("window")) : 10;
let colours = palette();
let watched = "";
let [status, statusAt] = [null, 0];
let [session, run, missed] = [null, null, 0];
let [frames, fps, framesAt, dirty] = [0, 0, 0, true];

const touch = () => (dirty = true);

// What programs see; numbers as they came.
window.__strapd = {
  state: "connecting",
  sensors: {},
  get fps() {
    return fps;
  },
  get frames() {
    return frames;
  },
  get dropped() {
    return missed;
  },
  get session() {
    return session;
  },
  get frozen() {
    return still;
  },
};
for (const name of ["q", "rpy", "seq"]) {
  Object.defineProperty(window.__strapd, name, {
    get: () => Object.values(window.__strapd.sensors)[0]?.[name] ?? null,
  });
}

function sensor(id) {
  const known = sensors.get(id);
  if (known) return known;
  if (only && !only.includes(id)) return null;
  if (sensors.size >= MOST_SENSORS) {
    left.add(id);
    return null;
  }
  const made = new Sensor(id, parts.template, touch, () => draw(performance.now()), () => anew(id));
  made.isPlayed = playback.isThere;
  sensors.set(id, made);
  // By name, but truth last: it is what the others are held against.
  const order = [...sensors.values()].sort(
    (a, b) => (a.id === "truth") - (b.id === "truth") || a.id.localeCompare(b.id, "en", { numeric: true }),
  );
  const next = order[order.indexOf(made) + 1];
  parts.sensors.insertBefore(made.element, next?.element ?? null);
  made.placed();
  for (const each of sensors.values()) each.choose(sensors);
  parts.waiting.hidden = true;
  parts.sensors.dataset.count = String(sensors.size);
  watch();
  return made;
}

// Every reader of this sensor sees it begin anew; the daemon takes it from its own page alone.
function anew(id) {
  link?.send({ class: "RESET", id });
}

// Asks for what can be drawn.
function watch() {
  if (!link?.isOpen) return;
  const share = Math.max(50, Math.floor(BUDGET / Math.max(1, sensors.size)));
  const rate_hz = document.hidden ? HIDDEN_HZ : asked > 0 ? asked : share;
  const ids = only ?? (left.size ? [...sensors.keys()] : undefined);
  const request = { class: "WATCH", enable: true, streams: ["ATT"], rate_hz, ids };
  const text = JSON.stringify(request);
  if (text === watched) return;
  watched = text;
  link.send(request);
}

function heard(message) {
  switch (message.class) {
    case "VERSION":
      greeted(message);
      break;
    case "ATT": {
      if (paused || still) break;
      const of = sensor(message.id);
      if (!of) break;
      of.take(message);
      touch();
      if (frozen && stopAt !== null && message.seq >= stopAt) freeze();
      break;
    }
    case "GAP":
      missed += message.dropped;
      sensors.get(message.id)?.gap(message);
      notice(`${whole(message.dropped)} attitudes of ${message.id} dropped: this page was too slow for them`);
      break;
    case "STATUS":
      told(message);
      break;
    case "RESET":
      notice(`${message.id} begins anew: ${message.from}`);
      break;
    case "PLAYBACK":
      played(message);
      break;
    case "ERROR":
      // The daemon that plays nothing does not know the word, and says so once.
      if (message.code !== "unknown_class") notice(`${message.code}: ${message.message}`);
      break;
  }
}

function played(message) {
  // A run that began anew: what was received before does not go with what comes.
  if (run !== null && message.session !== run) for (const each of sensors.values()) each.clear();
  run = message.session;
  playback.heard(message);
  for (const each of sensors.values()) each.isPlayed = true;
}

function greeted(version) {
  const restarted = session !== null && version.session !== session;
  session = version.session;
  say(parts.release, `strapd ${version.release}`);
  if (restarted) {
    for (const each of sensors.values()) each.clear();
    notice("the daemon was started again: attitudes begin anew");
  }
  watched = "";
  status = null;
  left.clear();
  run = null;
  playback.gone();
  watch();
  if (!frozen) link.send({ class: "POLL" });
}

function told(now) {
  const at = performance.now();
  const before = status;
  const elapsed = (at - statusAt) / 1000;
  const { sources = [], clients = [] } = now;
  const sum = (list, field) => list.reduce((total, each) => total + (each[field] ?? 0), 0);
  const count = (list) => list.reduce((total, source) => total + taken(source), 0);
  const rate = before ? Math.max(0, count(sources) - count(before.sources ?? [])) / elapsed : NaN;
  say(parts.total, Number.isFinite(rate) ? `${whole(Math.round(rate))} Hz` : "–");
  say(parts.clients, whole(clients.length));
  const dropped = sum(clients, "dropped");
  say(parts.dropped, whole(dropped));
  parts.dropped.closest("div").classList.toggle("bad", dropped > 0);
  const queued = sum(clients, "queued_bytes") / 1024;
  say(parts.queued, `${queued < 10 ? queued.toFixed(1) : queued.toFixed(0)} KiB`);
  say(parts.uptime, now.uptime_s < 120 ? `${now.uptime_s.toFixed(0)} s` : `${whole(Math.floor(now.uptime_s / 60))} min`);
  const gone = now.recording?.stopped ? "recording stopped" : now.recording ? "recording" : "";
  say(parts.recording, gone);
  for (const source of sources) {
    const of = sensor(source.id);
    of?.tell(source, before?.sources?.find((s) => s.id === source.id), elapsed);
  }
  const others = [...left].sort();
  parts.others.hidden = others.length === 0;
  say(parts.others, others.length ? `${others.length} more: ${others.slice(0, 8).join(", ")} (?ids=A,B shows others)` : "");
  [status, statusAt] = [now, at];
}

function changed(state, words) {
  window.__strapd.state = state;
  parts.connection.dataset.state = state;
  say(parts.connection, words);
  parts.token.hidden = state !== "token";
  if (state === "token") parts.tokenInput.focus();
  if (state !== "open") {
    status = null;
    playback?.gone();
  }
}

let noticeTimer;
function notice(text) {
  say(parts.notice, text);
  parts.notice.hidden = false;
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(() => (parts.notice.hidden = true), 8000);
}

function freeze() {
  still = true;
  parts.notice.hidden = true;
  link?.close();
  changed("frozen", "frozen");
  // Scales remember what they have shown, and that depends on the moment.
  for (const each of sensors.values()) for (const scale of Object.values(each.scales)) scale.reset();
  draw(Infinity);
}

function draw(now) {
  for (const each of sensors.values()) {
    each.compare();
    if (!each.surfaces || (!each.dirty && !(each.stale && now - each.shownAt > 100))) continue;
    each.dirty = false;
    each.draw(colours, seconds, now);
    if (!each.last) {
      delete window.__strapd.sensors[each.id];
      continue;
    }
    window.__strapd.sensors[each.id] = {
      q: each.last.q, rpy: rollPitchYaw(each.last.q), seq: each.last.seq, stamp: each.last.stamp,
      error: each.error, worst: each.worst, tips: each.tips, centre: each.centre, scale: each.scale,
      camera: { ...each.view.camera }, points: each.history.total, dropped: each.dropped,
      plotted: each.plotted,
    };
  }
}

// The pose of a body nobody has heard of.
const neutral = new Surface(parts.neutral, rest);
function rest() {
  const scene = new Scene(neutral, new Camera(), colours);
  scene.world([]);
  scene.body((v) => v);
  scene.ends();
}

let drawnAt = -Infinity;
function tick(now) {
  requestAnimationFrame(tick);
  // A little early rather than a whole frame late.
  if (now - drawnAt < FRAME - 4) return;
  const some = [...sensors.values()];
  if (dirty || some.some((each) => each.stale)) {
    dirty = false;
    drawnAt = now;
    draw(now);
    frames++;
  }
  if (now - framesAt >= 1000 && !frozen) {
    fps = ((frames - (tick.before ?? 0)) * 1000) / (now - framesAt);
    [framesAt, tick.before] = [now, frames];
    say(parts.fps, fps.toFixed(0));
  }
}

function pause(on) {
  paused = on;
  parts.pause.setAttribute("aria-pressed", String(on));
  say(parts.pauseWords, on ? "Go on" : "Pause");
  document.body.classList.toggle("paused", on);
  if (on) return;
  // What came meanwhile was not kept: the lines begin anew.
  for (const each of sensors.values()) each.interrupted = true;
}

function zeroYaw() {
  for (const each of sensors.values()) each.zeroYaw();
  const on = [...sensors.values()].some((each) => each.view.yaw !== 0);
  parts.zero.setAttribute("aria-pressed", String(on));
  touch();
}

function reset() {
  for (const each of sensors.values()) each.home();
  missed = 0;
  parts.zero.setAttribute("aria-pressed", "false");
  touch();
}

function span(value) {
  seconds = value;
  parts.window.value = String(value);
  for (const each of sensors.values()) {
    each.dirty = true;
    for (const scale of Object.values(each.scales)) scale.reset();
  }
  touch();
}

const playback = new Playback(document.querySelector("#playback"), (message) => link?.send(message));

const KEYS = {
  " ": () => pause(!paused),
  z: zeroYaw,
  r: reset,
  "[": () => span(WINDOWS[Math.max(0, WINDOWS.indexOf(seconds) - 1)]),
  "]": () => span(WINDOWS[Math.min(WINDOWS.length - 1, WINDOWS.indexOf(seconds) + 1)]),
  "?": () => (parts.help.open ? parts.help.close() : parts.help.showModal()),
  p: () => playback.toggle(),
  ",": () => playback.step(-5),
  ".": () => playback.step(5),
  "-": () => playback.faster(-1),
  "+": () => playback.faster(1),
};

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName);
  const pressing = event.target.tagName === "BUTTON" && event.key === " ";
  if (typing || pressing || !KEYS[event.key]) return;
  event.preventDefault();
  KEYS[event.key]();
});
parts.pause.addEventListener("click", () => pause(!paused));
parts.zero.addEventListener("click", zeroYaw);
parts.reset.addEventListener("click", reset);
parts.helpButton.addEventListener("click", () => parts.help.showModal());
parts.window.addEventListener("change", () => span(Number(parts.window.value)));
parts.token.addEventListener("submit", (event) => {
  event.preventDefault();
  link.authorise(parts.tokenInput.value);
  parts.tokenInput.value = "";
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  colours = palette();
  rest();
  for (const each of sensors.values()) each.dirty = true;
  touch();
});
document.addEventListener("visibilitychange", watch);
parts.window.value = String(seconds);

rest();
let link = null;
if (frozen && stopAt === null) {
  for (const att of demonstration(LAST)) heard(att);
  freeze();
} else {
  link = new Link(heard, changed);
  if (!frozen) setInterval(() => link.send({ class: "POLL" }), 1000);
}
requestAnimationFrame(tick);
