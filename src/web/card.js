// One sensor on the page: its drawing and its numbers, now or where the cursor is.

import { Camera, Scene, steer, upright, worldNames, zLocus } from "./body3d.js";
import { clockTime } from "./clock.js";
import { drawHorizon } from "./horizon.js";
import { Known } from "./known.js";
import { plain, say, show } from "./numbers.js";
import { drawPlot } from "./plot.js";
import { aboutZ, DEGREES, product, rollPitchYaw, rotate } from "./quaternion.js";
import { Scale } from "./scale.js";
import { isRecorded, isReference } from "./sensor.js";
import { Surface } from "./surface.js";
import { writeDoubts, writeHealth, writeNumbers } from "./writing.js";

// Seconds of the path of the z axis.
const LOCUS = 10;
// Its curves, from above.
const PLOTS = ["errors", "angles", "rates", "accelerations"];
// Milliseconds between two changes of the numbers: faster nobody reads.
const READABLE = 100;

export class Card {
  // does: place() is the instant of a recording that is shown ahead of its attitudes, NaN of what is live;
  // moved() draws soon; resized() at once, a canvas that changes its size is empty; anew() begins it anew;
  // folded() after it was folded by hand; save(kind) writes a file.
  constructor(sensor, template, view, does) {
    this.sensor = sensor;
    this.id = sensor.id;
    this.timeView = view;
    this.place = does.place;
    this.view = { camera: new Camera(), yaw: 0 };
    this.scales = { rate: new Scale(0.2), angle: new Scale(2), error: new Scale(1e-6), acceleration: new Scale(0.1) };
    this.against = null;
    this.element = template.content.firstElementChild.cloneNode(true);
    this.element.dataset.id = this.id;
    this.name = plain(this.id);
    this.element.setAttribute("aria-label", `Sensor ${this.name}`);
    this.parts = {};
    for (const part of this.element.querySelectorAll("[data-part]")) this.parts[part.dataset.part] = part;
    const { parts } = this;
    say(parts.name, this.name);
    parts.known.setAttribute("aria-label", `What is known of ${this.name}`);
    this.known = new Known(parts, does.anew);
    this.moved = () => {
      this.dirty = true;
      does.moved();
    };
    this.resized = () => {
      this.dirty = true;
      does.resized();
    };
    parts.against.addEventListener("change", () => {
      this.chosen = parts.against.value;
      this.forgetErrors();
      does.moved();
    });
    parts.fold.addEventListener("click", () => {
      this.unfolded = this.isFolded;
      this.fold(!this.isFolded);
      does.folded();
    });
    for (const kind of ["png", "csv"]) parts[kind].addEventListener("click", () => does.save(kind));
    // The card of the sensor it belongs to draws it, dashed.
    this.fold(isRecorded(this.id));
    this.clear();
  }

  // Once it is on the page, where its canvases have a size.
  placed() {
    const surfaces = {};
    for (const name of ["body", "horizon", ...PLOTS, "ellipse"]) {
      surfaces[name] = new Surface(this.parts[name], this.resized);
    }
    this.surfaces = surfaces;
    steer(this.parts.body, this.view.camera, this.moved);
    const plot = { clock: () => this.sensor.clock, span: () => this.span() };
    for (const name of PLOTS) this.timeView.attach(this.parts[name], plot);
  }

  gone() {
    for (const surface of Object.values(this.surfaces ?? {})) surface.gone();
    this.element.remove();
  }

  span() {
    return this.timeView.span(this.sensor.clock, this.sensor.history.newestTime);
  }

  clear() {
    this.sensor.clear();
    for (const scale of Object.values(this.scales)) scale.reset();
    this.dirty = true;
    this.shownAt = -Infinity;
  }

  home() {
    this.view.camera.home();
    this.view.yaw = 0;
    this.clear();
  }

  fold(on) {
    this.isFolded = on;
    this.element.classList.toggle("folded", on);
    this.parts.fold.setAttribute("aria-expanded", String(!on));
    this.dirty = true;
  }

  zeroYaw() {
    const yaw = this.sensor.last ? rollPitchYaw(this.sensor.last.q)[2] : 0;
    this.view.yaw = this.view.yaw === 0 ? yaw : 0;
    this.dirty = true;
    this.shownAt = -Infinity;
  }

  // Which sensor it is compared with: the one chosen, or its reference.
  choose(cards) {
    const others = [...cards.keys()].filter((id) => id !== this.id);
    const usual = [`${this.id} recorded`, "recorded", `${this.id} truth`, "truth"].find((id) => others.includes(id));
    const wanted = this.chosen ?? (isReference(this.id) ? "" : (usual ?? ""));
    const select = this.parts.against;
    const options = ["", ...others];
    if (options.join("\n") !== [...select.options].map((o) => o.value).join("\n")) {
      select.replaceChildren(
        ...options.map((id) => {
          const option = document.createElement("option");
          option.value = id;
          option.textContent = plain(id) || "nothing";
          return option;
        }),
      );
    }
    const against = cards.get(wanted)?.sensor ?? null;
    select.value = against ? wanted : "";
    if (against !== this.against) {
      this.against = against;
      this.forgetErrors();
    }
    this.parts.comparison.hidden = others.length === 0;
    this.parts.errorBox.hidden = !against;
  }

  forgetErrors() {
    this.sensor.forgetErrors();
    this.scales.error.reset();
    this.dirty = true;
  }

  draw(colours, now) {
    const { sensor, surfaces, view, parts } = this;
    const { history } = sensor;
    if (this.isFolded) {
      this.writeAt(now, null);
      return;
    }
    if (!sensor.last && !sensor.whole) {
      this.drawNothing(colours, "no data yet");
      return;
    }
    const cursor = this.timeView.cursor(sensor.clock);
    const plotted = this.drawPlots(colours, cursor);
    const isHeld = Number.isFinite(cursor);
    const at = isHeld ? plotted : this.ahead();
    this.held = isHeld ? { cursor, at: at && at.track.sample(at.number) } : null;
    this.shown = at ? at.track.sample(at.number) : null;
    if (isHeld && !at) {
      this.drawBody(colours, null);
      this.blank(`no data at ${clockTime(cursor)}`);
      return;
    }
    parts.empty.hidden = true;
    const track = at?.track ?? history;
    const number = at?.number ?? history.total - 1;
    const { q } = this.shown ?? sensor.last;
    this.drawBody(colours, { q, number, track });
    const zeroed = aboutZ(-view.yaw / DEGREES);
    const { world } = sensor;
    const seen = product(zeroed, q);
    const heading = rollPitchYaw(seen)[2];
    drawHorizon(surfaces.horizon, colours, seen, world, heading);
    this.known.draw(surfaces.ellipse, colours, rollPitchYaw(q)[2], world);
    this.writeAt(now, heading);
  }

  // The sample of a recording where it is to be, until its attitude has come from there.
  ahead() {
    const { whole, last } = this.sensor;
    if (!whole || whole.total === 0) return null;
    const place = this.place();
    if (last && Number.isNaN(place)) return null;
    const number = Math.max(0, whole.firstFrom((Number.isNaN(place) ? -Infinity : place) + 1e-6) - 1);
    return { number, track: whole };
  }

  // The instant of a recording that is shown.
  head() {
    const { sensor } = this;
    if (!sensor.whole) return NaN;
    const place = this.place();
    return Number.isNaN(place) ? sensor.last ? sensor.history.newestTime : sensor.whole.oldestTime : place;
  }

  // Worst and rms of the error: of a recording over all of it.
  errors() {
    const { sensor } = this;
    return this.isWhole() ? sensor.whole : sensor;
  }

  // Whether errors of the whole recording are those against what is chosen.
  isWhole() {
    const { sensor, against } = this;
    return Boolean(sensor.whole?.compared && against && isRecorded(against.id));
  }

  // The numbers, no faster than they can be read.
  writeAt(now, heading) {
    this.stale = now - this.shownAt < READABLE;
    if (this.stale) return;
    // A picture that stays is drawn at no moment.
    this.shownAt = Math.min(now, performance.now());
    if (heading !== null) writeNumbers(this, heading);
  }

  drawPlots(colours, cursor) {
    const { sensor, surfaces, parts } = this;
    const span = this.span();
    const selected = this.timeView.selection(sensor.clock);
    const strokes = [colours.x, colours.y, colours.z];
    const head = this.head();
    const draw = (name, track, series, names, scale, options) => {
      const of = (from) => [from?.[series]].flat();
      const [lows, highs] = [of(track.low), of(track.high)];
      const lines = of(track).map((values, n) => {
        const colour = names.length > 1 ? strokes[n] : colours.error;
        return { track, values, lows: lows[n], highs: highs[n], colour, name: names[n] };
      });
      return drawPlot(surfaces[name], colours, lines, { span, scale, cursor, head, selected, ...options });
    };
    const track = sensor.drawn(span);
    const { points } = draw("rates", track, "rate", ["x", "y", "z"], this.scales.rate);
    const { at } = draw("angles", track, "angle", ["roll", "pitch", "yaw"], this.scales.angle, { wraps: true });
    const compared = this.isWhole() ? track : sensor.history;
    const marks = this.isWhole() ? (this.against.whole?.cuts() ?? []) : [];
    this.marks = marks;
    parts.accelerationBox.hidden = !track.hasAcceleration;
    if (track.hasAcceleration) draw("accelerations", track, "acceleration", ["x", "y", "z"], this.scales.acceleration, {});
    if (this.against) draw("errors", compared, "error", ["error"], this.scales.error, { marks });
    this.plotted = { points, width: surfaces.rates.width };
    return at && { ...at, track };
  }

  // The body and who it is compared with, at an instant; null is a neutral pose: nothing is known.
  drawBody(colours, at) {
    const { sensor, surfaces, view, against } = this;
    const scene = new Scene(surfaces.body, view.camera, colours);
    if (!at) {
      scene.world([]);
      scene.body((v) => v);
      scene.ends();
      return;
    }
    const { world } = sensor;
    const zeroed = aboutZ(-view.yaw / DEGREES);
    const up = upright(world);
    const toView = (v) => up(rotate(zeroed, v));
    const seen = product(zeroed, at.q);
    const { track } = at;
    scene.world(worldNames(world));
    const own = zLocus(track, LOCUS, toView, at.number);
    const time = track.timeOf(at.number);
    // Both of the whole, or both of what came.
    const beside = track === sensor.history ? against?.history : against?.whole;
    const reached = against?.clock === sensor.clock ? (beside?.firstFrom(time + 1e-9) ?? 0) - 1 : (beside?.total ?? 0) - 1;
    // As the error is counted.
    const turn = (track === sensor.history && sensor.turn) || { w: 1, x: 0, y: 0, z: 0 };
    const other = beside ? zLocus(beside, LOCUS, (v) => toView(rotate(turn, v)), reached) : [];
    const all = sensor.whole ? zLocus(sensor.whole, Infinity, toView, sensor.whole.total - 1) : [];
    scene.locus(all, colours.z, false, 0.75, [], 0.15);
    scene.locus(other, colours.other, false, 1.5, [4, 4]);
    scene.locus(own, colours.z, false);
    if (other.length) {
      const q = product(product(zeroed, turn), beside.attitude(reached));
      scene.triad((v) => up(rotate(q, v)));
    }
    scene.body((v) => up(rotate(seen, v)));
    scene.locus(other, colours.other, true, 1.5, [4, 4]);
    scene.locus(own, colours.z, true);
    const { rate } = track.sample(at.number);
    const speed = Math.hypot(...rate);
    const fastest = Math.max(speed, track.fastest(LOCUS, at.number));
    if (speed > 1e-4 * DEGREES) {
      scene.arrow(up(rotate(seen, rate.map((v) => (v * 0.85) / fastest))), colours.rate);
    }
    scene.ends();
    this.tips = scene.tips;
    this.centre = scene.centre;
    this.scale = scene.scale;
  }

  // The body in a neutral pose, and no number.
  drawNothing(colours, words) {
    const { surfaces } = this;
    for (const name of PLOTS) surfaces[name].begin();
    this.drawBody(colours, null);
    this.blank(words);
  }

  blank(words) {
    const { parts, surfaces } = this;
    surfaces.horizon.begin();
    parts.empty.hidden = false;
    say(parts.empty, words);
    for (const number of this.element.querySelectorAll(".views data, figcaption data, [data-part=seq]")) show(number, NaN, 0);
    for (const name of ["stamp", "flags", "frame", "thinning", "dropped", "held"]) say(parts[name], "");
    for (const name of ["body", "horizon"]) parts[name].setAttribute("aria-label", `${this.name}: ${words}`);
    for (const name of PLOTS) parts[name].setAttribute("aria-valuetext", words);
    this.stale = false;
  }

  // The source as STATUS tells of it.
  tell(source, before, seconds) {
    writeHealth(this, source, before, seconds);
    writeDoubts(this.parts.doubts, source.findings ?? []);
    this.known.tell(source);
    if (!this.parts.known.hidden) this.moved();
  }
}
