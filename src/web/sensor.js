// One sensor on the page: its history, its drawing, its numbers.

import { Camera, Scene, steer, upright, worldNames, zLocus } from "./body3d.js";
import { History } from "./history.js";
import { drawHorizon } from "./horizon.js";
import { Known } from "./known.js";
import { fixed, measure, say, show, SECONDS, whole } from "./numbers.js";
import { drawPlot, Scale } from "./plot.js";
import { aboutZ, angleBetween, DEGREES, product, rollPitchYaw, rotate } from "./quaternion.js";
import { Surface } from "./surface.js";

// Seconds of the path of the z axis.
const LOCUS = 10;
// Milliseconds between two changes of the numbers: faster nobody reads.
const READABLE = 100;
// Steps of stamps that jitter is judged by.
const STEPS = 512;
// Seconds from one attitude of a recording to the next that are a leap.
const LEAP = 1;

// What a status may say without a need to be looked at.
const USUAL = new Set(["ok", "provisional", "aided", "rest"]);

// Samples so far, of a recording attitudes: STATUS knows one or the other.
export const taken = (source) => source.samples ?? source.sent ?? 0;

export class Sensor {
  // moved(): draw soon; resized(): draw at once, a canvas that changes its size is empty; ask(): begin it anew.
  constructor(id, template, moved, resized, ask) {
    this.id = id;
    this.history = new History();
    this.view = { camera: new Camera(), yaw: 0 };
    this.scales = { rate: new Scale(0.2), angle: new Scale(2), error: new Scale(1e-6) };
    this.against = null;
    this.steps = new Float64Array(STEPS);
    this.element = template.content.firstElementChild.cloneNode(true);
    this.element.dataset.id = id;
    this.element.setAttribute("aria-label", `Sensor ${id}`);
    this.parts = {};
    for (const part of this.element.querySelectorAll("[data-part]")) this.parts[part.dataset.part] = part;
    say(this.parts.name, id);
    this.known = new Known(this.parts, ask);
    this.moved = () => {
      this.dirty = true;
      moved();
    };
    this.resized = () => {
      this.dirty = true;
      resized();
    };
    this.parts.against.addEventListener("change", () => {
      this.chosen = this.parts.against.value;
      this.forgetErrors();
      moved();
    });
    this.clear();
  }

  // Once it is on the page, where its canvases have a size.
  placed() {
    const surfaces = {};
    for (const name of ["body", "horizon", "rates", "angles", "errors", "ellipse"]) {
      surfaces[name] = new Surface(this.parts[name], this.resized);
    }
    this.surfaces = surfaces;
    steer(this.parts.body, this.view.camera, this.moved);
  }

  clear() {
    this.history.clear();
    this.last = null;
    this.first = null;
    this.seen = 0;
    this.skipped = 0;
    this.dropped = 0;
    this.stepsTaken = 0;
    this.interrupted = false;
    this.worst = NaN;
    for (const scale of Object.values(this.scales)) scale.reset();
    this.dirty = true;
    this.shownAt = -Infinity;
  }

  home() {
    this.view.camera.home();
    this.view.yaw = 0;
    this.clear();
  }

  zeroYaw() {
    const yaw = this.last ? rollPitchYaw(this.last.q)[2] : 0;
    this.view.yaw = this.view.yaw === 0 ? yaw : 0;
    this.dirty = true;
    this.shownAt = -Infinity;
  }

  // An ATT of this sensor.
  take(att) {
    const { stamp, q, rate } = att;
    if (!stamp || !q) return;
    if (att.status?.includes("last")) {
      const { last } = this;
      // After a lost connection: the one that is shown.
      if (last?.seq === att.seq && last.stamp.sec === stamp.sec && last.stamp.nsec === stamp.nsec) return;
      // What came before it was not seen, which is another matter than thinned.
      this.interrupted = true;
    }
    this.first ??= stamp;
    // Differences before they become one float: nanoseconds survive.
    const time = stamp.sec - this.first.sec + (stamp.nsec - this.first.nsec) * 1e-9;
    if (this.last && time < this.history.newestTime) {
      // A recording that was taken back: times go on from the same zero.
      const first = this.first;
      this.clear();
      this.first = first;
    } else if (this.isPlayed && time - this.history.newestTime > LEAP) {
      // Or forward: what was passed over was not thinned.
      this.interrupted = true;
    }
    const last = this.last;
    const jumped = last && (att.reset !== last.reset || this.interrupted);
    if (last && att.seq > last.seq && !this.interrupted) {
      this.skipped += att.seq - last.seq - 1;
      const step = time - this.history.newestTime;
      if (att.seq === last.seq + 1) this.steps[this.stepsTaken++ % STEPS] = step;
    }
    this.seen += this.interrupted ? 0 : 1;
    this.interrupted = false;
    const degrees = [0, 1, 2].map((axis) => (rate?.[axis] ?? NaN) * DEGREES);
    this.history.push(time, q, degrees, Boolean(jumped));
    this.last = att;
    this.dirty = true;
  }

  gap(notice) {
    this.dropped += notice.dropped;
    // What was dropped was not left out on request.
    this.skipped -= notice.dropped;
    this.dirty = true;
  }

  // Which sensor it is compared with: the one chosen, or `truth`.
  choose(sensors) {
    const others = [...sensors.keys()].filter((id) => id !== this.id);
    const wanted = this.chosen ?? (others.includes("truth") && this.id !== "truth" ? "truth" : "");
    const select = this.parts.against;
    const options = ["", ...others];
    if (options.join("\n") !== [...select.options].map((o) => o.value).join("\n")) {
      select.replaceChildren(
        ...options.map((id) => {
          const option = document.createElement("option");
          option.value = id;
          option.textContent = id || "nothing";
          return option;
        }),
      );
    }
    const against = sensors.get(wanted) ?? null;
    select.value = against ? wanted : "";
    if (against !== this.against) {
      this.against = against;
      this.forgetErrors();
    }
    this.parts.comparison.hidden = others.length === 0;
    this.parts.errorBox.hidden = !against;
  }

  forgetErrors() {
    this.history.error.fill(NaN);
    this.history.compared = this.history.oldest;
    this.worst = NaN;
    this.error = NaN;
    this.scales.error.reset();
    this.dirty = true;
  }

  // Error angles of what both have reached. Stamps count from each one's first: brought together here.
  compare() {
    const { history, against } = this;
    if (!against?.first || !this.first) return;
    const offset =
      this.first.sec - against.first.sec + (this.first.nsec - against.first.nsec) * 1e-9;
    const reached = against.history.newestTime;
    const before = history.compared;
    while (history.compared < history.total && history.timeOf(history.compared) + offset <= reached + 1e-9) {
      const number = history.compared++;
      const time = Math.min(reached, history.timeOf(number) + offset);
      const truth = against.history.attitudeAt(time);
      if (!truth) continue;
      const error = angleBetween(truth, history.attitude(number)) * DEGREES;
      history.error[history.slot(number)] = error;
      this.error = error;
      this.worst = Math.max(Number.isNaN(this.worst) ? 0 : this.worst, error);
    }
    if (history.compared !== before) this.dirty = true;
  }

  get jitter() {
    const n = Math.min(this.stepsTaken, STEPS);
    if (n < 16) return NaN;
    const steps = this.steps.slice(0, n).sort();
    const usual = steps[n >> 1];
    const off = steps.map((step) => Math.abs(step - usual)).sort();
    return off[Math.floor(0.99 * (n - 1))];
  }

  // What one attitude that came stands for.
  get thinning() {
    return this.seen > 1 ? (this.seen - 1 + Math.max(0, this.skipped)) / (this.seen - 1) : 1;
  }

  draw(colours, seconds, now) {
    const { history, surfaces, view, parts } = this;
    parts.empty.hidden = this.last !== null;
    if (!this.last) {
      this.drawNothing(colours);
      return;
    }
    const { q } = this.last;
    const world = this.last.world ?? "start";
    const zeroed = aboutZ(-view.yaw / DEGREES);
    const up = upright(world);
    const toView = (v) => up(rotate(zeroed, v));
    const seen = product(zeroed, q);

    const scene = new Scene(surfaces.body, view.camera, colours);
    scene.world(worldNames(world));
    const own = zLocus(history, LOCUS, toView);
    const other = this.against ? zLocus(this.against.history, LOCUS, toView) : [];
    const { rate } = this.last;
    const speed = rate ? Math.hypot(...rate) : 0;
    scene.locus(other, colours.other, false, 1.5, [4, 4]);
    scene.locus(own, colours.z, false);
    scene.body((v) => up(rotate(seen, v)));
    scene.locus(other, colours.other, true, 1.5, [4, 4]);
    scene.locus(own, colours.z, true);
    const fastest = Math.max(speed, history.fastest(LOCUS) / DEGREES);
    if (speed > 1e-4) {
      const length = 0.85 / fastest;
      scene.arrow(up(rotate(seen, rate.map((v) => v * length))), colours.rate);
    }
    scene.ends();
    this.tips = scene.tips;
    this.centre = scene.centre;
    this.scale = scene.scale;

    const angles = rollPitchYaw(q);
    const heading = rollPitchYaw(seen)[2];
    drawHorizon(surfaces.horizon, colours, seen, world, heading);
    this.known.draw(surfaces.ellipse, colours, angles[2], world);
    const axes = [colours.x, colours.y, colours.z];
    const common = { seconds, strokes: axes };
    const points = drawPlot(surfaces.rates, colours, history, { ...common, series: history.rate, scale: this.scales.rate });
    drawPlot(surfaces.angles, colours, history, { ...common, series: history.angle, scale: this.scales.angle, wraps: true });
    this.plotted = { points, width: surfaces.rates.width };
    if (this.against) {
      drawPlot(surfaces.errors, colours, history, {
        seconds, strokes: [colours.error], series: [history.error], scale: this.scales.error,
      });
    }
    if (now - this.shownAt >= READABLE) {
      this.shownAt = now;
      this.write(q, angles, heading, speed);
      this.stale = false;
    } else {
      this.stale = true;
    }
  }

  // The body in a neutral pose, and no number: nothing is known.
  drawNothing(colours) {
    const { surfaces, parts } = this;
    for (const name of ["horizon", "rates", "angles", "errors"]) surfaces[name].begin();
    const scene = new Scene(surfaces.body, this.view.camera, colours);
    scene.world([]);
    scene.body((v) => v);
    scene.ends();
    for (const number of this.element.querySelectorAll("data")) show(number, NaN, 0);
    for (const name of ["stamp", "flags", "frame", "thinning", "dropped"]) say(parts[name], "");
    for (const name of ["body", "horizon"]) parts[name].setAttribute("aria-label", `${this.id}: no data yet`);
    this.stale = false;
  }

  write(q, angles, heading, speed) {
    const { parts, last, view } = this;
    for (const name of ["w", "x", "y", "z"]) show(parts[`q${name}`], q[name], 9);
    show(parts.roll, angles[0], 4);
    show(parts.pitch, angles[1], 4);
    show(parts.yaw, view.yaw ? heading : angles[2], 4);
    say(parts.yawName, view.yaw ? "yaw, zeroed" : "yaw");
    this.element.classList.toggle("zeroed", view.yaw !== 0);
    for (const [n, name] of ["x", "y", "z"].entries()) {
      show(parts[`rate${name}`], (last.rate?.[n] ?? NaN) * DEGREES, 3);
      show(parts[`sigma${name}`], last.sigma_deg?.[n] ?? NaN, 3);
    }
    show(parts.speed, speed * DEGREES, 3);
    say(parts.seq, whole(last.seq));
    parts.seq.value = String(last.seq);
    say(parts.stamp, `${fixed(this.history.newestTime, 3)} s`);
    const flags = (last.status ?? []).filter((flag) => !USUAL.has(flag));
    say(parts.flags, flags.join(" "));
    parts.flags.title = flags.includes("last") ? "The last there was when this page came; none since." : "";
    say(parts.frame, `${last.body} → ${last.world}`);
    if (this.against) {
      show(parts.error, this.error, 6);
      show(parts.worst, this.worst, 6);
    }
    const part = this.thinning;
    say(
      parts.thinning,
      part < 1.0005 ? "every sample" : `1 of ${Number(part.toFixed(part < 10 ? 1 : 0))} samples`,
    );
    parts.thinning.title =
      part < 1.0005
        ? "Everything the daemon made is in the plots."
        : "The daemon thins what it sends here; peaks between those samples are not in the plots.";
    say(parts.dropped, this.dropped ? `${whole(this.dropped)} dropped on the way` : "");
    const spoken = angles.map((a) => fixed(a, 0));
    parts.body.setAttribute("aria-label", `Body axes of ${this.id}: roll ${spoken[0]}, pitch ${spoken[1]}, yaw ${spoken[2]} degrees`);
    parts.horizon.setAttribute("aria-label", `Horizon: roll ${spoken[0]}, pitch ${spoken[1]} degrees`);
  }

  // The source as STATUS tells of it.
  tell(source, before, seconds) {
    const { parts } = this;
    const rate = before && seconds > 0 ? (taken(source) - taken(before)) / seconds : NaN;
    const nominal = source.rate_hz ?? NaN;
    say(parts.rateNow, Number.isFinite(rate) ? `${whole(Math.round(rate))} Hz` : "–");
    say(parts.rateNominal, Number.isFinite(nominal) ? `of ${whole(Math.round(nominal * 10) / 10)}` : "");
    say(parts.jitter, measure(source.jitter_s ?? this.jitter, SECONDS));
    const counts = source.counts ?? {};
    const cells = {
      gaps: source.gaps,
      // JSON has no NaN: a sender's becomes null.
      nan: (counts.not_finite ?? 0) + (counts.no_gyro ?? 0),
      lost: source.lost,
      missing: source.missing,
    };
    for (const [name, value] of Object.entries(cells)) {
      say(parts[name], whole(value));
      parts[name].closest("div").classList.toggle("bad", value > 0);
    }
    say(parts.method, source.method ?? "");
    this.known.tell(source);
    if (!parts.known.hidden) this.moved();
  }
}
