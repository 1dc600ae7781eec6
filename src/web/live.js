// The live page: messages -> sensors -> at most 30 pictures a second.

import { Asking } from "./asking.js";
import { Camera, Scene } from "./body3d.js";
import { Cards } from "./cards.js";
import { Clocks } from "./clock.js";
import { demonstration, LAST } from "./demonstration.js";
import { Fleet } from "./fleet.js";
import { listen } from "./keys.js";
import { invited, Link } from "./link.js";
import { Overview } from "./overview.js";
import { plain, say, whole } from "./numbers.js";
import { Playback } from "./playback.js";
import { save } from "./save.js";
import { told } from "./status.js";
import { palette, Surface } from "./surface.js";
import { TimeView } from "./timeview.js";
import { Together } from "./together.js";
import { publish, seen } from "./window.js";

const FRAME = 1000 / 30;
const WINDOWS = [2, 5, 10, 30, 60, 300];

const parameters = new URLSearchParams(location.search);
const only = parameters.get("ids")?.split(",").filter(Boolean);
const frozen = parameters.get("frozen") === "1";
const stopAt = parameters.has("seq") ? Number(parameters.get("seq")) : null;

const parts = {};
for (const part of document.querySelectorAll("[data-page]")) parts[part.dataset.page] = part;

const clocks = new Clocks();
let [paused, still, dirty] = [false, false, true];
let colours = palette();
let [session, run, missed] = [null, null, 0];
let [frames, fps, framesAt] = [0, 0, 0];

const touch = () => (dirty = true);
let cards = null;
const each = (does) => cards?.forEach(does);
const chosen = Number(parameters.get("window"));
const view = new TimeView(WINDOWS.includes(chosen) ? chosen : 10, () => {
  each((card) => (card.dirty = true));
  touch();
});
// The others are in the table alone.
cards = new Cards({ parts, view, clocks, only }, {
  place: () => playback.ahead,
  moved: touch,
  resized: () => draw(performance.now()),
  changed: () => {
    each((card) => (card.sensor.isPlayed = playback.isThere));
    watch();
    touch();
  },
  anew: (id, where) => link?.send({ class: "RESET", id, ...where }),
  save: (card, kind) => save(card, kind, colours, notice),
});
const together = new Together(parts.together, touch);
const fleet = new Fleet(parts, {
  zero: () => link?.send({ class: "RESET", all: true, heading: 0 }),
  choose: (id, on) => {
    cards.choose(id, on);
    fleet.sort(null);
  },
  shown: (id) => cards.has(id),
  isSilent: (row) => !(performance.now() - row.heardAt < 5000) && performance.now() - row.since > 2000,
});

const asking = new Asking({
  cards,
  only,
  rate: Number(parameters.get("rate_hz")),
  heardBeside: (att) => {
    fleet.heard(att);
    touch();
  },
});

const overview = new Overview({
  clocks,
  token: () => link?.token,
  of: (id) => cards.of(id)?.sensor,
  changed: (isEmpty) => {
    if (isEmpty) say(parts.waitingTitle, "The recording has no sample to show");
    parts.windowField.hidden = true;
    say(parts.liveWords, "Whole recording");
    each((card) => {
      card.dirty = true;
      card.shownAt = -Infinity;
    });
    touch();
  },
});

publish({
  fps: () => fps,
  frames: () => frames,
  dropped: () => missed,
  session: () => session,
  frozen: () => still,
  view: () => ({ live: view.isLive, seconds: view.seconds, range: view.range?.span ?? null }),
  together: () => together.drawn ?? [],
});

function watch() {
  asking.watch(link);
}

function heard(message) {
  switch (message.class) {
    case "VERSION":
      greeted(message);
      break;
    case "ATT": {
      if (!only || only.includes(message.id)) fleet.heard(message);
      const of = cards.of(message.id);
      of?.sensor.heard(message);
      if (paused || still || !of) break;
      of.sensor.take(message);
      if (of.sensor.whole) playback.reached(of.sensor.history.newestTime);
      of.dirty = true;
      touch();
      if (frozen && stopAt !== null && message.seq >= stopAt) freeze();
      break;
    }
    case "GAP": {
      missed += message.dropped;
      const of = cards.get(message.id);
      of?.sensor.gap(message);
      if (of) of.dirty = true;
      notice(`${whole(message.dropped)} attitudes of ${plain(message.id)} dropped: this page was too slow for them`);
      break;
    }
    case "STATUS":
      told(parts, message, (source, before, elapsed) => {
        if (only && !only.includes(source.id)) return;
        fleet.tell(source, before, elapsed);
        cards.of(source.id)?.tell(source, before, elapsed);
      });
      // A recording that waits, or a view that does, makes nobody silent.
      cards.arrange(!playback.isThere && !paused);
      break;
    case "RESET":
      if (message.sensors) notice(`${message.sensors.length} sensors begin anew: ${message.sensors[0]?.from}`);
      else notice(`${plain(message.id)} begins anew: ${message.from}`);
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
  if (run !== message.session) {
    if (overview.isThere) each((some) => some.sensor.clear());
    else {
      if (run !== null) forget();
      clocks.begin(message.start);
    }
  }
  run = message.session;
  if (message.overview && message.start) overview.begin(message.start);
  playback.heard(message);
  each((some) => (some.sensor.isPlayed = true));
}

function forget() {
  overview.end();
  each(({ sensor }) => (sensor.whole = sensor.detail = null));
  each((some) => some.clear());
  clocks.begin(null);
  view.home();
}

function greeted(version) {
  const restarted = session !== null && version.session !== session;
  session = version.session;
  say(parts.release, `strapd ${version.release}`);
  if (restarted) {
    forget();
    fleet.forget();
    notice("the daemon was started again: attitudes begin anew");
  }
  asking.forget();
  told(parts, null);
  if (restarted) cards.left.clear();
  run = null;
  playback.gone();
  watch();
  if (!frozen) link.send({ class: "POLL" });
}

function changed(state, words) {
  seen().state = state;
  parts.connection.dataset.state = state;
  say(parts.connection, words);
  parts.token.hidden = state !== "token";
  if (state === "token") parts.tokenInput.focus();
  if (state !== "open") {
    told(parts, null);
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
  each((some) => Object.values(some.scales).forEach((scale) => scale.reset()));
  draw(Infinity);
}

function draw(now) {
  clocks.update(cards.all.map((some) => some.sensor));
  if (overview.clock) overview.look(view.span(overview.clock, 0), cards.all.map((some) => some.sensor));
  each((some) => {
    if (some.sensor.compare(some.against)) some.dirty = true;
    if (!some.surfaces || (!some.dirty && !(some.stale && now - some.shownAt > 100))) return;
    some.dirty = false;
    some.draw(colours, now);
    seen(some);
  });
  parts.live.hidden = view.isLive;
  // One of each: where a sensor itself can be zeroed the view need not be, and a recording is paused by its own button.
  parts.zero.hidden = cards.all.some((some) => !some.parts.yawZero.hidden);
  parts.pause.hidden = playback.isThere;
  fleet.draw(now);
  if (!parts.fleet.hidden) together.draw(cards.all, view, colours);
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
  if (dirty || cards.all.some((some) => some.stale)) {
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
  // What came meanwhile was not kept: the lines begin anew.
  if (!on) each((some) => (some.sensor.interrupted = true));
}

function zeroYaw() {
  each((some) => some.zeroYaw());
  const on = cards.all.some((some) => some.view.yaw !== 0);
  parts.zero.setAttribute("aria-pressed", String(on));
  touch();
}

function reset() {
  each((some) => some.home());
  missed = 0;
  parts.zero.setAttribute("aria-pressed", "false");
  view.home();
}

function span(value) {
  view.seconds = value;
  parts.window.value = String(value);
  each((some) => Object.values(some.scales).forEach((scale) => scale.reset()));
  view.home();
}

const playback = new Playback(document.querySelector("#playback"), (message) => link?.send(message));
playback.moved = () => {
  each((card) => {
    card.dirty = true;
    card.shownAt = -Infinity;
  });
  touch();
};
listen(parts, {
  pause: () => pause(!paused),
  zeroYaw,
  reset,
  live: () => view.home(),
  window: (by) => span(WINDOWS[Math.max(0, Math.min(WINDOWS.length - 1, WINDOWS.indexOf(view.seconds) + by))]),
  span,
  playback,
  authorise: (token) => link.authorise(token),
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  colours = palette();
  rest();
  each((some) => (some.dirty = true));
  touch();
});
document.addEventListener("visibilitychange", watch);
parts.window.value = String(view.seconds);

rest();
let link = null;
if (frozen && stopAt === null) {
  for (const att of demonstration(LAST)) heard(att);
  freeze();
} else {
  link = new Link(heard, changed);
  // Another link, opened in this tab.
  addEventListener("hashchange", () => {
    const token = invited();
    if (token) link.authorise(token);
  });
  if (!frozen) setInterval(() => link.send({ class: "POLL" }), 1000);
}
requestAnimationFrame(tick);
