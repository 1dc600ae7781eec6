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
    this.element.hidden = true;
  }

  heard(state) {
    if (!state.at) return;
    this.state = state;
    this.element.hidden = false;
    const { toggle, slider, speed, name, place } = this.parts;
    // Of a stream nobody knows the end, or the start.
    const length = this.length;
    const at = this.place;
    const playing = state.state === "playing";
    say(toggle, playing ? "Pause" : state.state === "ended" ? "Again" : "Play");
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

  // By so many seconds.
  step(by) {
    if (!this.isThere || !this.state.start) return;
    const end = Number.isNaN(this.length) ? Infinity : this.length;
    const to = Math.max(0, Math.min(end, this.place + by));
    this.send({ action: "seek", at: later(this.state.start, to) });
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
    if (!done && now - (this.soughtAt ?? -Infinity) < SPACING) return;
    this.soughtAt = now;
    this.send({ action: "seek", at: later(this.state.start, Number(this.parts.slider.value)) });
  }
}
