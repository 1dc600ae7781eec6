// The sensors that are drawn: which, in which order, and which are folded.

import { Card } from "./card.js";
import { Sensor } from "./sensor.js";

// As many as two screens hold.
const MOST = 8;

export class Cards extends Map {
  // page: { parts, view, clocks, only }; does: what a card may ask for, and changed() after one came or went.
  constructor(page, does) {
    super();
    this.page = page;
    this.does = does;
    // Known, and not drawn.
    this.left = new Set();
  }

  get all() {
    return [...this.values()];
  }

  // The card of a sensor, made where there is room; else null.
  of(id) {
    const known = this.get(id);
    if (known) return known;
    const { parts, view, clocks, only } = this.page;
    if (only && !only.includes(id)) return null;
    if (this.size >= MOST) {
      this.left.add(id);
      return null;
    }
    const made = new Card(new Sensor(id, clocks), parts.template, view, {
      moved: this.does.moved,
      resized: this.does.resized,
      anew: () => this.does.anew(id),
      save: (kind) => this.does.save(made, kind),
    });
    this.set(id, made);
    this.left.delete(id);
    this.arrange(false);
    made.placed();
    this.settle();
    return made;
  }

  // Which are compared with which, after one came or went.
  settle() {
    for (const card of this.values()) card.choose(this);
    const { parts } = this.page;
    parts.waiting.hidden = this.size > 0;
    parts.sensors.dataset.count = String(this.size);
    this.does.changed();
  }

  // By name, but truth last: it is what the others are held against; and behind it who is silent, folded.
  arrange(isJudged) {
    const now = performance.now();
    const isLive = (card) => !card.sensor.isSilent(now);
    // Where nobody speaks nobody is silent.
    if (isJudged && this.all.some(isLive)) {
      for (const card of this.values()) {
        const wasSilent = card.isSilent;
        card.isSilent = !isLive(card);
        if (card.isSilent !== wasSilent && !card.unfolded) card.fold(card.isSilent);
      }
    }
    const order = this.all.sort(
      (a, b) =>
        Boolean(a.isSilent) - Boolean(b.isSilent) ||
        (a.id === "truth") - (b.id === "truth") ||
        a.id.localeCompare(b.id, "en", { numeric: true }),
    );
    const { sensors, waiting } = this.page.parts;
    let at = waiting.nextElementSibling;
    for (const { element } of order) {
      if (element === at) at = at.nextElementSibling;
      else sensors.insertBefore(element, at);
    }
  }

  remove(id) {
    this.get(id)?.gone();
    this.delete(id);
    this.left.add(id);
  }

  // A sensor of the table is drawn, or no more, or it alone. Where there is no room the one drawn longest goes.
  choose(id, on) {
    if (on === "alone") for (const other of [...this.keys()]) if (other !== id) this.remove(other);
    if (on === false) this.remove(id);
    else {
      if (!this.has(id) && this.size >= MOST) this.remove(this.keys().next().value);
      this.of(id);
    }
    this.settle();
  }
}
