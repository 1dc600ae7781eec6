// The sensors that are drawn: which, in which order, and which are folded.

import { Card } from "./card.js";
import { isRecorded, isReference, Sensor } from "./sensor.js";

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

  // The card of a sensor, made where there is room; else null. One that was left out comes where it is wanted alone.
  of(id, isWanted = false) {
    const known = this.get(id);
    if (known) return known;
    if (this.left.has(id) && !isWanted) return null;
    const { parts, view, clocks, only } = this.page;
    if (only && !only.includes(id)) return null;
    if (this.size >= MOST) {
      this.left.add(id);
      return null;
    }
    const made = new Card(new Sensor(id, clocks), parts.template, view, {
      place: this.does.place,
      moved: this.does.moved,
      resized: this.does.resized,
      anew: (where) => this.does.anew(id, where),
      folded: () => this.count(),
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
    this.count();
    this.does.changed();
  }

  // One that is not folded has all of the width.
  count() {
    this.page.parts.sensors.dataset.count = String(this.all.filter((card) => !card.isFolded).length);
    this.does.moved();
  }

  // By name, but truth and what was recorded last: the others are held against it; and behind it who is silent, folded.
  arrange(isJudged) {
    const now = performance.now();
    const isLive = (card) => !card.sensor.isSilent(now);
    // Where nobody speaks nobody is silent.
    if (isJudged && this.all.some(isLive)) {
      for (const card of this.values()) {
        const wasSilent = card.isSilent;
        card.isSilent = !isLive(card);
        const isChanged = card.isSilent !== Boolean(wasSilent);
        if (isChanged && !card.unfolded && !isRecorded(card.id)) card.fold(card.isSilent);
      }
      this.count();
    }
    const order = this.all.sort(
      (a, b) =>
        Boolean(a.isSilent) - Boolean(b.isSilent) ||
        isReference(a.id) - isReference(b.id) ||
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
      this.of(id, true);
    }
    this.settle();
  }
}
