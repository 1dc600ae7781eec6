// The whole recording that is played, as the daemon has looked through it: fetched when the page opens, and once more,
// in detail, of a part that is looked at.

import { later, secondsBetween } from "./clock.js";
import { Whole } from "./whole.js";

// Points of a sensor that are asked for.
const POINTS = 2000;
// Milliseconds until it is asked again while the daemon is still looking.
const AGAIN = 300;
// Milliseconds a part must stay before it is asked for.
const STILL = 80;

const padded = (value) => String(value).padStart(9, "0");

export class Overview {
  // page: { clocks, token(), of(id): its sensor or null, changed() }.
  constructor(page) {
    this.page = page;
    this.end();
  }

  get isThere() {
    return this.isComplete !== undefined;
  }

  // The daemon plays nothing, or something else.
  end() {
    this.turn = (this.turn ?? 0) + 1;
    this.isComplete = undefined;
    this.clock = null;
    clearTimeout(this.timer);
    this.asked = null;
  }

  // A recording is played that starts at `start`.
  async begin(start) {
    if (this.isThere) return;
    this.isComplete = false;
    const { turn } = this;
    while (turn === this.turn && !this.isComplete) {
      const found = await this.fetch("");
      if (turn !== this.turn) return;
      if (found) this.take(found, start);
      if (!this.isComplete) await new Promise((done) => setTimeout(done, AGAIN));
    }
  }

  async fetch(query) {
    const token = this.page.token();
    try {
      const answer = await fetch(`/overview?points=${POINTS}${query}`, token ? { headers: { Authorization: `Bearer ${token}` } } : {});
      return answer.ok ? await answer.json() : null;
    } catch {
      return null;
    }
  }

  take(found, start) {
    this.isComplete = found.complete;
    let isEmpty = true;
    for (const stream of found.streams) {
      const sensor = this.page.of(stream.id);
      if (!sensor) continue;
      const clock = this.page.clocks.of(start ?? stream.start);
      const whole = new Whole(stream, secondsBetween(clock.epoch, stream.start), clock);
      sensor.clock ??= clock;
      sensor.whole = whole;
      sensor.detail = null;
      this.clock ??= clock;
      const ends = [whole.oldestTime, Math.max(whole.newestTime, whole.oldestTime + whole.length)];
      clock.whole = isEmpty ? ends : [Math.min(clock.whole[0], ends[0]), Math.max(clock.whole[1], ends[1])];
      // Of one sample, too, there is an axis.
      if (!(clock.whole[1] > clock.whole[0])) clock.whole = [clock.whole[0] - 0.5, clock.whole[0] + 0.5];
      isEmpty = false;
    }
    this.page.changed(found.complete && found.streams.length === 0);
  }

  // What the plots show: a part of it comes in detail, where there is more than what is drawn.
  look([from, to], sensors) {
    if (!this.isThere || !this.clock) return;
    const [start, end] = this.clock.whole;
    const isPart = to - from < 0.7 * (end - start);
    const isCoarse = sensors.some(({ whole }) => whole && whole.samples > whole.total);
    const key = isPart && isCoarse && this.isComplete ? `${from} ${to}` : null;
    if (key === this.asked) return;
    this.asked = key;
    clearTimeout(this.timer);
    if (key !== null) this.timer = setTimeout(() => this.detail(from, to), STILL);
  }

  async detail(from, to) {
    const { turn, asked, clock } = this;
    const room = 0.25 * (to - from);
    const stamp = (time) => {
      const { sec, nsec } = later(clock.epoch, time);
      return `${sec}.${padded(nsec)}`;
    };
    const found = await this.fetch(`&from=${stamp(from - room)}&to=${stamp(to + room)}`);
    if (!found || turn !== this.turn || asked !== this.asked) return;
    for (const stream of found.streams) {
      const sensor = this.page.of(stream.id);
      if (!sensor?.whole || !stream.time.length) continue;
      const part = new Whole(stream, secondsBetween(clock.epoch, stream.start), clock);
      part.covers = [from - room, to + room];
      sensor.detail = part;
    }
    this.page.changed(false);
  }
}
