// One sensor: what came of it, and what follows from that. Nothing is drawn here.

import { secondsBetween } from "./clock.js";
import { History } from "./history.js";
import { aligned, angleBetween, DEGREES, product } from "./quaternion.js";

// Steps of stamps that jitter is judged by.
const STEPS = 512;
// Seconds from one attitude of a recording to the next that are a leap.
const LEAP = 1;
// Milliseconds without a word after which a sensor is silent, while others speak.
const SILENCE = 5000;

// Samples so far, of a recording what was shown: those passed over on the way to another place did not come.
export const taken = (source) => source.sent ?? source.samples ?? 0;

// What the others are held against: a simulator's truth, orientations in a recording.
export const isTruth = (id) => /(^|. )truth$/.test(id);
export const isRecorded = (id) => /(^| )recorded$/.test(id);
export const isReference = (id) => isTruth(id) || isRecorded(id);

export class Sensor {
  constructor(id, clocks) {
    this.id = id;
    this.clocks = clocks;
    this.history = new History();
    // Whoever sends under this name sends as regularly when a recording or the daemon begins anew.
    this.steps = new Float64Array(STEPS);
    this.stepsTaken = 0;
    // Who is there already when the page comes has a moment to speak.
    this.heardAt = performance.now() - 0.6 * SILENCE;
    // Of a recording: all of it, and a part in detail.
    this.whole = null;
    this.detail = null;
    this.clear();
  }

  clear() {
    this.history.clear();
    this.clock = this.whole?.clock ?? null;
    this.last = null;
    this.seen = 0;
    this.skipped = 0;
    this.dropped = 0;
    this.interrupted = false;
    this.forgetErrors();
  }

  forgetErrors() {
    this.history.error.fill(NaN);
    this.history.compared = this.history.oldest;
    this.worst = NaN;
    this.error = NaN;
    [this.squares, this.errors] = [0, 0];
    this.turn = null;
  }

  // Somebody spoke; whether it is shown is another matter.
  heard(att) {
    if (!att.status?.includes("last")) this.heardAt = performance.now();
  }

  isSilent(now) {
    return now - this.heardAt > SILENCE;
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
    this.clock ??= this.clocks.of(stamp);
    const time = secondsBetween(this.clock.epoch, stamp);
    // Pictures may wait, as those of a tab in the background do.
    if (!(time <= this.clock.newest)) this.clock.newest = time;
    if (this.last && time < this.history.newestTime) {
      // A recording that was taken back.
      const { clock } = this;
      this.clear();
      this.clock = clock;
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
    const sigma = [0, 1, 2].map((axis) => att.sigma_deg?.[axis] ?? NaN);
    const acceleration = att.world_linear_acceleration;
    this.history.push(time, { seq: att.seq, q, rate: degrees, sigma, acceleration }, Boolean(jumped));
    this.last = att;
  }

  gap(notice) {
    this.dropped += notice.dropped;
    // What was dropped was not left out on request.
    this.skipped -= notice.dropped;
  }

  // Error angles to `against` of what both have reached. Says whether there are new ones.
  compare(against) {
    const { history } = this;
    if (!against?.clock || !this.clock) return false;
    const offset = secondsBetween(against.clock.epoch, this.clock.epoch);
    const reached = against.history.newestTime;
    const before = history.compared;
    while (history.compared < history.total && history.timeOf(history.compared) + offset <= reached + 1e-9) {
      const number = history.compared++;
      const time = Math.min(reached, history.timeOf(number) + offset);
      const truth = against.history.attitudeAt(time);
      if (!truth) continue;
      const own = history.attitude(number);
      this.turn ??= aligned(this.last.world, own, against.last.world, truth);
      const error = angleBetween(product(this.turn, truth), own) * DEGREES;
      history.error[history.slot(number)] = error;
      this.error = error;
      this.squares += error * error;
      this.errors++;
      this.worst = Math.max(Number.isNaN(this.worst) ? 0 : this.worst, error);
    }
    return history.compared !== before;
  }

  get rms() {
    return this.errors ? Math.sqrt(this.squares / this.errors) : NaN;
  }

  // What the plots draw between two times: of a recording all of it, as fine as it is there.
  drawn([from, to]) {
    const { whole, detail, history } = this;
    if (detail && detail.covers[0] <= from && detail.covers[1] >= to) return detail;
    return whole ?? history;
  }

  get world() {
    return this.last?.world ?? this.whole?.world ?? "start";
  }

  get bodyAxes() {
    return this.last?.body ?? this.whole?.body ?? "";
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
}
