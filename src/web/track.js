// Instants in order, and what a plot asks of them. Those of a sensor are a ring (`history.js`).

export class Track {
  constructor(time, broken) {
    this.time = time;
    this.capacity = time.length;
    // A line must not be drawn from the instant before to this one.
    this.broken = broken ?? new Uint8Array(time.length);
    // Instants ever pushed; the newest is number total - 1.
    this.total = time.length;
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

  get oldestTime() {
    return this.total > 0 ? this.timeOf(this.oldest) : NaN;
  }

  // Number of the first not before `time`.
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

  // Number of the one nearest to `time`, if it is no farther than `most`; else -1.
  nearest(time, most) {
    const after = this.firstFrom(time);
    const early = after > this.oldest ? time - this.timeOf(after - 1) : Infinity;
    const late = after < this.total ? this.timeOf(after) - time : Infinity;
    if (!(Math.min(early, late) <= most)) return -1;
    return early < late ? after - 1 : after;
  }
}
