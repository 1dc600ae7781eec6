// What came of one sensor lately, in rings of fixed size: memory does not grow with time.

import { between, rollPitchYaw } from "./quaternion.js";

const CAPACITY = 1 << 15;

export class History {
  constructor(capacity = CAPACITY) {
    this.capacity = capacity;
    this.time = new Float64Array(capacity);
    this.q = new Float64Array(4 * capacity);
    this.rate = [0, 1, 2].map(() => new Float32Array(capacity));
    this.angle = [0, 1, 2].map(() => new Float32Array(capacity));
    this.error = new Float32Array(capacity);
    // A line must not be drawn from the sample before to this one.
    this.broken = new Uint8Array(capacity);
    this.clear();
  }

  clear() {
    // Samples ever pushed; the newest is number total - 1.
    this.total = 0;
    this.compared = 0;
  }

  get oldest() {
    return Math.max(0, this.total - this.capacity);
  }

  slot(number) {
    return number % this.capacity;
  }

  timeOf(number) {
    return this.time[number % this.capacity];
  }

  get newestTime() {
    return this.total > 0 ? this.timeOf(this.total - 1) : NaN;
  }

  push(time, q, rate, broken) {
    const slot = this.total % this.capacity;
    this.time[slot] = time;
    this.q.set([q.w, q.x, q.y, q.z], 4 * slot);
    const angles = rollPitchYaw(q);
    for (let axis = 0; axis < 3; axis++) {
      this.rate[axis][slot] = rate[axis];
      this.angle[axis][slot] = angles[axis];
    }
    this.error[slot] = NaN;
    this.broken[slot] = broken ? 1 : 0;
    this.total++;
    this.compared = Math.max(this.compared, this.oldest);
  }

  attitude(number) {
    const at = 4 * (number % this.capacity);
    return { w: this.q[at], x: this.q[at + 1], y: this.q[at + 2], z: this.q[at + 3] };
  }

  // Number of the first sample not before `time`.
  firstFrom(time) {
    let low = this.oldest;
    let high = this.total;
    while (low < high) {
      const middle = Math.floor((low + high) / 2);
      if (this.timeOf(middle) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // Greatest rate of the last `seconds`, looked at here and there: for the length of an arrow.
  fastest(seconds) {
    const from = this.firstFrom(this.newestTime - seconds);
    const step = Math.ceil((this.total - from) / 200) || 1;
    let most = 0;
    for (let n = Math.ceil(from / step) * step; n < this.total; n += step) {
      const slot = this.slot(n);
      const speed = Math.hypot(this.rate[0][slot], this.rate[1][slot], this.rate[2][slot]);
      if (speed > most) most = speed;
    }
    return most;
  }

  // Attitude at `time`, between its neighbours; null outside, and across a hole.
  attitudeAt(time) {
    const after = this.firstFrom(time);
    if (after >= this.total) return null;
    const late = this.timeOf(after);
    if (late === time) return this.attitude(after);
    if (after === this.oldest || this.broken[this.slot(after)]) return null;
    const early = this.timeOf(after - 1);
    if (late - early > 0.5) return null;
    return between(this.attitude(after - 1), this.attitude(after), (time - early) / (late - early));
  }
}
