// One stream of a recording over all of its time, or a part: in each stretch the first sample, the least and the
// greatest value. To plots, bodies and numbers it is what `history.js` is.

import { rollPitchYaw } from "./quaternion.js";
import { Track } from "./track.js";

const number = (value) => value ?? NaN;
const columns = (rows, from, count) => Array.from({ length: count }, (_, n) => Float64Array.from(rows, (row) => number(row[from + n])));

function grouped(rows) {
  return { rate: columns(rows, 0, 3), angle: columns(rows, 3, 3), error: columns(rows, 6, 1)[0], acceleration: columns(rows, 7, 3) };
}

export class Whole extends Track {
  // `offset`: seconds from the zero of the clock to the first sample of the stream.
  constructor(stream, offset, clock) {
    super(Float64Array.from(stream.time, (time) => time + offset), Uint8Array.from(stream.cut));
    this.clock = clock;
    this.world = stream.world;
    this.body = stream.body;
    this.samples = stream.samples;
    this.length = stream.length_s;
    this.compared = stream.compared;
    this.worst = number(stream.worst_deg);
    this.rms = number(stream.rms_deg);
    this.q = stream.q;
    this.seq = stream.seq;
    this.count = stream.count;
    Object.assign(this, grouped(stream.first));
    // Behind the error, where the recording is replayed with it.
    this.hasAcceleration = stream.first[0]?.length > 7;
    this.low = grouped(stream.low);
    this.high = grouped(stream.high);
    const unknown = new Float64Array(this.total).fill(NaN);
    this.sigma = [unknown, unknown, unknown];
  }

  attitude(n) {
    const [w, x, y, z] = this.q[n];
    return { w, x, y, z };
  }

  sample(n) {
    const q = this.attitude(n);
    return {
      time: this.time[n], seq: this.seq[n], q, error: this.error[n],
      rate: this.rate.map((each) => each[n]), angle: rollPitchYaw(q), sigma: [NaN, NaN, NaN],
      acceleration: this.acceleration.map((each) => each[n]),
    };
  }

  fastest(seconds, last) {
    let most = 0;
    for (let n = this.firstFrom(this.timeOf(last) - seconds); n <= last; n++) {
      most = Math.max(most, Math.hypot(...this.rate.map((each) => each[n])) || 0);
    }
    return most;
  }

  // Instants at which it begins anew.
  cuts() {
    return [...this.time].filter((_, n) => this.broken[n]);
  }

  // Samples that one stretch stands for, on the average of a part.
  thinning(from, to) {
    const [first, last] = [this.firstFrom(from), this.firstFrom(to)];
    if (last <= first) return 1;
    let sum = 0;
    for (let n = first; n < last; n++) sum += this.count[n];
    return sum / (last - first);
  }
}
