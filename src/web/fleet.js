// All sensors in a table: sorted by any column, who is silent last. From STATUS, and a few attitudes a second.

import { secondsBetween } from "./clock.js";
import { fixed, meaning, plain, say, sigma, whole } from "./numbers.js";
import { Twice } from "./known.js";
import { aligned, angleBetween, DEGREES, product, rollPitchYaw, turned } from "./quaternion.js";
import { isTruth, taken } from "./sensor.js";

const REDRAWN = 500;
// Seconds between two attitudes that are held against each other.
const NEAR = 0.02;
// No more digits than the sigma of the row leaves, and no more than `most`.
const degrees = (of, most) => ({ of, say: (value, row) => fixed(value, Math.min(most, meaning(row.sigma))) });
const count = (of) => ({ of, say: (value) => (value === undefined ? "–" : whole(value)), isCount: true });

// Columns by name: a value to sort by, and its words. NaN and undefined are last.
const COLUMNS = {
  sensor: { of: (row) => row.id, say: plain },
  state: { of: (row, now) => row.state(now)[1], say: (value, row, now) => row.state(now)[0] },
  age: { of: (row, now) => row.age(now), say: (value) => (Number.isFinite(value) ? (value < 10 ? fixed(value, 1) : whole(Math.floor(value))) : "–") },
  rate: { of: (row) => row.rate, say: (value) => (Number.isFinite(value) ? `${whole(Math.round(value))}` : "–") },
  roll: degrees((row) => row.angles[0], 1),
  pitch: degrees((row) => row.angles[1], 1),
  yaw: degrees((row) => row.angles[2], 1),
  speed: degrees((row) => row.speed, 1),
  sigma: { of: (row) => row.sigma, say: sigma },
  error: { of: (row) => row.error, say: (value) => fixed(value, Math.min(3, meaning(value) + 1)) },
  gaps: count((row) => row.source?.gaps),
  lost: count((row) => row.source?.lost),
};

const NOTHING = [NaN, NaN, NaN];
// JSON has no NaN: what nobody knows is null, and not 0.
const size = (vector) => Math.hypot(...(vector ?? NOTHING).map((value) => value ?? NaN));

class Row {
  constructor(id, template, choose) {
    this.id = id;
    // Of a reference: the sensor whose it is.
    this.reference = /^(.+) (?:truth|recorded)$/.exec(id)?.[1];
    this.angles = NOTHING;
    this.speed = this.sigma = this.error = this.rate = NaN;
    this.since = performance.now();
    this.heardAt = NaN;
    this.element = template.content.firstElementChild.cloneNode(true);
    this.element.dataset.sensor = id;
    this.cells = {};
    for (const cell of this.element.querySelectorAll("[data-cell]")) this.cells[cell.dataset.cell] = cell;
    this.box = this.element.querySelector("input");
    this.box.setAttribute("aria-label", `Draw ${plain(id)}`);
    this.box.addEventListener("change", () => choose(id, this.box.checked));
    this.alone = this.cells.sensor;
    this.alone.addEventListener("click", () => choose(id, "alone"));
  }

  hear(att, now) {
    const { q, rate, sigma_deg } = att;
    if (!q) return;
    if (att.reset !== this.reset || att.world !== this.world) this.turn = null;
    [this.q, this.angular] = [q, rate];
    [this.stamp, this.world, this.reset] = [att.stamp, att.world, att.reset];
    this.angles = rollPitchYaw(q);
    this.speed = size(rate) * DEGREES;
    this.sigma = size(sigma_deg);
    if (!att.status?.includes("last")) this.heardAt = now;
  }

  // Error angle to a truth, degrees; worlds of two names agree where both are known first.
  errorTo(truth) {
    if (!this.q || !truth?.q || this === truth) return NaN;
    const seconds = secondsBetween(truth.stamp, this.stamp);
    if (Math.abs(seconds) > NEAR) return NaN;
    const then = truth.angular ? turned(truth.q, truth.angular, seconds) : truth.q;
    this.turn ??= aligned(this.world, this.q, truth.world, then);
    return angleBetween(product(this.turn, then), this.q) * DEGREES;
  }

  // Seconds since an attitude came.
  age(now) {
    return Math.max(0, now - this.heardAt) / 1000;
  }

  // In words, and by what it is sorted.
  state(now) {
    if (!this.q) return ["no data", Infinity];
    if (!Number.isFinite(this.heardAt)) return ["ended", 1e9];
    const ago = this.age(now);
    return ago < 5 ? ["live", 0] : [`silent ${whole(Math.floor(ago))} s`, ago];
  }
}

export class Fleet {
  // does: zero(), choose(id, on | "alone"), shown(id), isSilent(id), moved().
  constructor(parts, does) {
    this.parts = parts;
    this.does = does;
    this.rows = new Map();
    this.by = "sensor";
    this.down = false;
    this.isFolded = false;
    this.drawnAt = -Infinity;
    for (const button of parts.fleetHead.querySelectorAll("button")) {
      button.addEventListener("click", () => this.sort(button.dataset.sort));
    }
    this.zero = new Twice(parts.fleetZero, does.zero);
    this.zero.name("Yaw zero, all");
    parts.fleetSearch.addEventListener("input", () => this.sort(null));
    parts.fleetFold.addEventListener("click", () => {
      this.isFolded = !this.isFolded;
      this.drawnAt = -Infinity;
      this.draw(performance.now());
    });
  }

  row(id) {
    let row = this.rows.get(id);
    if (!row) {
      row = new Row(id, this.parts.fleetRow, this.does.choose);
      this.rows.set(id, row);
    }
    return row;
  }

  forget() {
    for (const row of this.rows.values()) row.element.remove();
    this.rows.clear();
  }

  heard(att) {
    this.row(att.id).hear(att, performance.now());
  }

  tell(source, before, seconds) {
    const row = this.row(source.id);
    row.source = source;
    row.rate = before && seconds > 0 ? (taken(source) - taken(before)) / seconds : NaN;
  }

  // null: as before, but at once.
  sort(by) {
    if (by) [this.by, this.down] = [by, this.by === by && !this.down];
    this.drawnAt = -Infinity;
    this.draw(performance.now());
  }

  // Rows but those of references that belong to one of the others: they are in its error, and in its card.
  get own() {
    return [...this.rows.values()].filter((row) => !this.rows.has(row.reference));
  }

  get order() {
    const now = performance.now();
    const { of } = COLUMNS[this.by];
    const sense = this.down ? -1 : 1;
    const isNothing = (value) => value === undefined || Number.isNaN(value);
    const keyed = this.own.map((row) => ({ row, value: of(row, now), silent: this.does.isSilent(row) }));
    return keyed.sort((a, b) => {
      if (a.silent !== b.silent) return a.silent - b.silent;
      if (isNothing(a.value) !== isNothing(b.value)) return isNothing(a.value) - isNothing(b.value);
      const name = a.row.id.localeCompare(b.row.id, "en", { numeric: true });
      if (typeof a.value === "string") return sense * name;
      return sense * (a.value - b.value) || name;
    });
  }

  draw(now) {
    const { parts } = this;
    // Of one sensor, or a sensor and its truth, there is nothing to compare in a table.
    const own = new Set(this.own);
    parts.fleet.hidden = own.size < 3;
    if (parts.fleet.hidden || now - this.drawnAt < REDRAWN) return;
    this.drawnAt = now;
    const truthOf = (id) => this.rows.get(`${id} truth`) ?? this.rows.get("truth");
    const hasTruth = [...this.rows.keys()].some(isTruth);
    const order = this.order;
    const wanted = parts.fleetSearch.value.trim().toLowerCase();
    const silent = order.filter((each) => each.silent).length;
    parts.fleetFold.hidden = silent === 0;
    parts.fleetFold.setAttribute("aria-expanded", String(!this.isFolded));
    parts.fleetZero.hidden = !order.some(({ row }) => row.source?.resets !== undefined && row.source?.attitude?.aided === "gravity");
    say(parts.fleetFold, `${silent} silent`);
    say(parts.fleetTitle, `${own.size} sensors`);
    parts.fleetHead.querySelector("[data-column=error]").hidden = !hasTruth;
    for (const head of parts.fleetHead.querySelectorAll("th[data-column]")) {
      const isBy = head.dataset.column === this.by;
      head.setAttribute("aria-sort", isBy ? (this.down ? "descending" : "ascending") : "none");
    }
    for (const row of this.rows.values()) if (!own.has(row)) row.element.remove();
    let at = parts.fleetBody.firstElementChild;
    for (const { row, silent: isSilent } of order) {
      // Moved where it must be, and only then: a focus is not lost.
      if (row.element === at) at = at.nextElementSibling;
      else parts.fleetBody.insertBefore(row.element, at);
      row.element.hidden = (isSilent && this.isFolded) || !plain(row.id).toLowerCase().includes(wanted);
      if (row.element.hidden) continue;
      row.error = row.errorTo(truthOf(row.id));
      row.cells.error.hidden = !hasTruth;
      row.element.classList.toggle("silent", isSilent);
      row.box.checked = this.does.shown(row.id);
      for (const [name, column] of Object.entries(COLUMNS)) {
        const value = column.of(row, now);
        say(row.cells[name], column.say(value, row, now));
        if (column.isCount) row.cells[name].classList.toggle("bad", value > 0);
      }
    }
  }
}
