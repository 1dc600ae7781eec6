// Pause, seek and speed of a recording the daemon plays; not there until the daemon speaks of one.

import { clockTime, later, secondsBetween } from "./clock.js";
import { fixed, say } from "./numbers.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 100];
// Milliseconds between two seeks while the slider is dragged.
const SPACING = 100;

export class Playback {
  constructor(element, send) {
    this.element = element;
    this.send = (fields) => send({ class: "PLAYBACK", ...fields });
    this.parts = {};
    for (const part of element.querySelectorAll("[data-part]")) this.parts[part.dataset.part] = part;
    const { toggle, slider, speed } = this.parts;
    toggle.addEventListener("click", () => this.toggle());
    slider.addEventListener("input", () => this.drag(false));
    slider.addEventListener("change", () => this.drag(true));
    speed.replaceChildren(...SPEEDS.map((value) => this.option(value)));
    speed.addEventListener("change", () => this.send({ action: "speed", speed: Number(speed.value) }));
  }

  option(value) {
    const option = document.createElement("option");
    option.value = String(value);
    option.textContent = `${value}×`;
    return option;
  }

  // Seconds, NaN where there is no end.
  get length() {
    const { start, end } = this.state;
    return start && end ? Math.max(0, secondsBetween(start, end)) : NaN;
  }

  get place() {
    const { start, at } = this.state;
    return start ? Math.max(0, secondsBetween(start, at)) : 0;
  }

  get isThere() {
    return this.state !== undefined;
  }

  gone() {
    this.state = undefined;
    this.sought = undefined;
    this.element.hidden = true;
  }

  heard(state) {
    if (!state.at) return;
    this.state = state;
    // The run has gone on from there without a word of this page's sensors.
    if (!this.dragging && state.state === "playing" && this.place > this.sought + 1) this.sought = undefined;
    this.element.hidden = false;
    const { toggle, slider, speed, name, place } = this.parts;
    // Of a stream nobody knows the end, or the start.
    const length = this.length;
    const at = this.place;
    const playing = state.state === "playing";
    say(toggle, playing ? "Pause" : state.state === "ended" ? "Replay" : "Play");
    slider.hidden = Number.isNaN(length);
    toggle.setAttribute("aria-pressed", String(playing));
    slider.max = String(length || 0);
    if (!this.dragging) slider.value = String(at);
    slider.setAttribute("aria-valuetext", `${fixed(at, 1)} of ${fixed(length, 1)} seconds`);
    say(place, Number.isNaN(length) ? clockTime(at) : `${clockTime(at)} / ${clockTime(length)}`);
    say(name, state.file ?? "");
    const chosen = String(state.speed);
    if (![...speed.options].some((o) => o.value === chosen)) speed.append(this.option(state.speed));
    speed.value = chosen;
  }

  toggle() {
    if (!this.isThere) return;
    // After the end `play` begins again.
    this.send({ action: this.state.state === "playing" ? "pause" : "play" });
  }

  // The place that is gone to, until an attitude has come from there; NaN if none is.
  get ahead() {
    return this.sought ?? NaN;
  }

  // An attitude of this time has come.
  reached(time) {
    if (!this.dragging && time >= this.sought - 0.01) this.sought = undefined;
  }

  seek(to) {
    this.sought = to;
    this.moved?.();
    this.send({ action: "seek", at: later(this.state.start, to) });
  }

  // By so many seconds.
  step(by) {
    if (!this.isThere || !this.state.start) return;
    const end = Number.isNaN(this.length) ? Infinity : this.length;
    this.seek(Math.max(0, Math.min(end, this.place + by)));
  }

  faster(by) {
    if (!this.isThere) return;
    const at = SPEEDS.findIndex((speed) => speed >= this.state.speed);
    const speed = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, (at < 0 ? SPEEDS.length : at) + by))];
    this.send({ action: "speed", speed });
  }

  // While it is dragged a seek now and then, and one where it is let go.
  drag(done) {
    this.dragging = !done;
    const now = performance.now();
    const to = Number(this.parts.slider.value);
    // What is known of the place is shown at once.
    this.sought = to;
    this.moved?.();
    if (!done && now - (this.soughtAt ?? -Infinity) < SPACING) return;
    this.soughtAt = now;
    this.seek(to);
  }
}
