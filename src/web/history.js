// What came of one sensor lately, in rings of fixed size: memory does not grow with time.

import { between, rollPitchYaw } from "./quaternion.js";
import { Track } from "./track.js";

const CAPACITY = 1 << 15;

export class History extends Track {
  constructor(capacity = CAPACITY) {
    super(new Float64Array(capacity));
    this.q = new Float64Array(4 * capacity);
    this.seq = new Float64Array(capacity);
    this.rate = [0, 1, 2].map(() => new Float64Array(capacity));
    this.angle = [0, 1, 2].map(() => new Float32Array(capacity));
    this.sigma = [0, 1, 2].map(() => new Float32Array(capacity));
    this.error = new Float64Array(capacity);
    // Without gravity, along the world: most sensors have none.
    this.acceleration = null;
    this.clear();
  }

  clear() {
    this.total = 0;
    this.compared = 0;
    this.acceleration = null;
    // The ordinary time from one to the next: the shortest lately.
    this.step = Infinity;
  }

  // Degrees, degrees a second, and m/s^2.
  push(time, { seq, q, rate, sigma, acceleration }, broken) {
    const slot = this.total % this.capacity;
    const step = this.total ? time - this.timeOf(this.total - 1) : 0;
    if (step > 0) this.step = Math.min(1.05 * this.step, step);
    this.time[slot] = time;
    this.seq[slot] = seq;
    this.q.set([q.w, q.x, q.y, q.z], 4 * slot);
    const angles = rollPitchYaw(q);
    for (let axis = 0; axis < 3; axis++) {
      this.rate[axis][slot] = rate[axis];
      this.angle[axis][slot] = angles[axis];
      this.sigma[axis][slot] = sigma[axis];
    }
    if (acceleration) this.acceleration ??= [0, 1, 2].map(() => new Float32Array(this.capacity).fill(NaN));
    this.acceleration?.forEach((values, axis) => {
      values[slot] = acceleration?.[axis] ?? NaN;
    });
    this.error[slot] = NaN;
    this.broken[slot] = broken ? 1 : 0;
    this.total++;
    this.compared = Math.max(this.compared, this.oldest);
  }

  attitude(number) {
    const at = 4 * (number % this.capacity);
    return { w: this.q[at], x: this.q[at + 1], y: this.q[at + 2], z: this.q[at + 3] };
  }

  get hasAcceleration() {
    return this.acceleration !== null;
  }

  // All that is known of one.
  sample(number) {
    const slot = this.slot(number);
    const of = (values) => values.map((each) => each[slot]);
    return {
      time: this.time[slot], seq: this.seq[slot], q: this.attitude(number), error: this.error[slot],
      rate: of(this.rate), angle: of(this.angle), sigma: of(this.sigma), acceleration: of(this.acceleration ?? []),
    };
  }

  // Greatest rate of the `seconds` up to number `last`, looked at here and there: for the length of an arrow.
  fastest(seconds, last) {
    const from = this.firstFrom(this.timeOf(last) - seconds);
    const step = Math.ceil((last + 1 - from) / 200) || 1;
    let most = 0;
    for (let n = Math.ceil(from / step) * step; n <= last; n += step) {
      const slot = this.slot(n);
      const speed = Math.hypot(this.rate[0][slot], this.rate[1][slot], this.rate[2][slot]);
      if (speed > most) most = speed;
    }
    return most;
  }

  // Attitude at `time`, between its neighbours; null outside, and across a hole: what was dropped on the way to a slow
  // page turned on meanwhile.
  attitudeAt(time) {
    const after = this.firstFrom(time);
    if (after >= this.total) return null;
    const late = this.timeOf(after);
    if (late === time) return this.attitude(after);
    if (after === this.oldest || this.broken[this.slot(after)]) return null;
    const early = this.timeOf(after - 1);
    if (late - early > Math.min(0.5, 4 * this.step)) return null;
    return between(this.attitude(after - 1), this.attitude(after), (time - early) / (late - early));
  }
}
