// Which stretch of time the plots show and where in it one looks: one for all plots of a page.

import { EDGES } from "./plot.js";

// Shortest and longest stretch, seconds.
const [LEAST, MOST] = [1e-4, 864000];
// Pixels a pointer may move and still have clicked.
const STILL = 4;
// Milliseconds after the page was scrolled in which a wheel goes on scrolling it.
const SCROLLING = 300;

export class TimeView {
  // moved(): draw soon.
  constructor(seconds, moved) {
    this.seconds = seconds;
    this.moved = moved;
    this.scrolledAt = -Infinity;
    addEventListener("scroll", () => (this.scrolledAt = performance.now()), { passive: true, capture: true });
    this.home();
  }

  // As it comes, up to the newest.
  home() {
    // Of a clock: { clock, span }, { clock, time }; { plot, part } moves with what is drawn.
    this.range = this.pinned = this.hovered = this.selected = null;
    this.moved();
  }

  get isLive() {
    return !this.range && !this.pinned;
  }

  // What is shown of one who was heard at `newest` last. Who has ended long ago shows its own end.
  span(clock, newest) {
    if (this.range && this.range.clock === clock) return this.range.span;
    if (clock?.whole) return clock.whole;
    const end = newest > clock?.newest - this.seconds ? clock.newest : newest;
    return Number.isFinite(end) ? [end - this.seconds, end] : [-this.seconds, 0];
  }

  // Where one looks, NaN where not.
  cursor(clock) {
    if (this.hovered) {
      const { plot, part } = this.hovered;
      if (plot.clock() !== clock) return NaN;
      const [from, to] = plot.span();
      return from + part * (to - from);
    }
    return this.pinned && this.pinned.clock === clock ? this.pinned.time : NaN;
  }

  selection(clock) {
    return this.selected?.clock === clock ? this.selected.span : null;
  }

  show(clock, from, to) {
    const length = Math.max(LEAST, Math.min(MOST, to - from));
    const middle = (from + to) / 2;
    this.range = { clock, span: [middle - length / 2, middle + length / 2] };
    this.moved();
  }

  // `factor` times as long, `about` stays where it is.
  zoom(plot, about, factor) {
    const [from, to] = plot.span();
    const kept = Math.max(LEAST / (to - from), Math.min(MOST / (to - from), factor));
    this.show(plot.clock(), about - (about - from) * kept, about + (to - about) * kept);
  }

  pan(plot, by) {
    const [from, to] = plot.span();
    this.show(plot.clock(), from + by, to + by);
  }

  // Looks at an instant, and stays there.
  pin(plot, time) {
    const [from, to] = plot.span();
    this.pinned = { clock: plot.clock(), time };
    this.hovered = null;
    const by = time < from ? time - from : time > to ? time - to : 0;
    this.show(plot.clock(), from + by, to + by);
  }

  // plot: { clock(), span() }. The canvas is a slider to those who do not see it: its value is the instant.
  attach(canvas, plot) {
    const partOf = (event) => {
      const { left, width } = canvas.getBoundingClientRect();
      const within = (event.clientX - left - EDGES.left) / (width - EDGES.left - EDGES.right);
      return Math.max(0, Math.min(1, within));
    };
    const timeOf = (part, [from, to] = plot.span()) => from + part * (to - from);
    const hover = (event) => {
      this.hovered = event.pointerType === "touch" ? null : { plot, part: partOf(event) };
      this.moved();
    };
    // Pointers that are down: where they began, in pixels and time.
    const down = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      const span = [...plot.span()];
      for (const each of down.values()) Object.assign(each, { span, part: each.now, time: timeOf(each.now, span) });
      const part = partOf(event);
      const pans = event.pointerType === "touch" || event.shiftKey;
      down.set(event.pointerId, { x: event.clientX, part, now: part, span, time: timeOf(part, span), pans, has: false });
    });
    canvas.addEventListener("pointermove", (event) => {
      const one = down.get(event.pointerId);
      if (!one) return hover(event);
      one.now = partOf(event);
      one.has ||= Math.abs(event.clientX - one.x) > STILL || down.size > 1;
      if (!one.has) return;
      const length = one.span[1] - one.span[0];
      const other = [...down.values()].find((each) => each !== one);
      if (other && Math.abs(one.now - other.now) > 0.02) {
        // What is under two fingers stays under them.
        const scale = (one.time - other.time) / (one.now - other.now);
        if (scale > 0) this.show(plot.clock(), one.time - one.now * scale, one.time + (1 - one.now) * scale);
      } else if (one.pans) {
        const by = (one.part - one.now) * length;
        this.show(plot.clock(), one.span[0] + by, one.span[1] + by);
      } else {
        const ends = [one.time, timeOf(one.now, one.span)].sort((a, b) => a - b);
        this.selected = { clock: plot.clock(), span: ends };
        this.hovered = null;
        this.moved();
      }
    });
    const up = (event, isDone) => {
      const one = down.get(event.pointerId);
      down.delete(event.pointerId);
      const chosen = this.selected?.span;
      this.selected = null;
      if (one && isDone && !one.has) this.pin(plot, timeOf(one.part));
      else if (one && isDone && chosen && chosen[1] > chosen[0]) this.show(plot.clock(), ...chosen);
      this.moved();
    };
    canvas.addEventListener("pointerup", (event) => up(event, true));
    canvas.addEventListener("pointercancel", (event) => up(event, false));
    canvas.addEventListener("pointerleave", () => {
      if (this.hovered?.plot === plot) this.hovered = null;
      this.moved();
    });
    canvas.addEventListener("dblclick", () => this.home());
    canvas.addEventListener("wheel", (event) => this.wheel(event, plot, timeOf(partOf(event))), { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event, plot));
  }

  wheel(event, plot, about) {
    const isScrolling = performance.now() - this.scrolledAt < SCROLLING;
    if (isScrolling && !event.ctrlKey) return;
    event.preventDefault();
    // Lines are about 16 pixels.
    const unit = event.deltaMode === 1 ? 16 : 1;
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY) || event.shiftKey) {
      const [from, to] = plot.span();
      this.pan(plot, ((event.deltaX || event.deltaY) * unit * (to - from)) / 1000);
    } else {
      this.zoom(plot, about, Math.exp(Math.max(-0.5, Math.min(0.5, event.deltaY * unit * 0.0015))));
    }
  }

  key(event, plot) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const [from, to] = plot.span();
    const length = to - from;
    const cursor = this.cursor(plot.clock());
    const at = Number.isFinite(cursor) ? cursor : to;
    const step = length * (event.shiftKey ? 0.1 : 0.01);
    const about = cursor >= from && cursor <= to ? cursor : (from + to) / 2;
    const does = {
      ArrowLeft: () => this.pin(plot, at - step),
      ArrowRight: () => this.pin(plot, at + step),
      Home: () => this.pin(plot, from),
      End: () => this.pin(plot, to),
      PageUp: () => this.pan(plot, -0.8 * length),
      PageDown: () => this.pan(plot, 0.8 * length),
      "+": () => this.zoom(plot, about, 0.7),
      "=": () => this.zoom(plot, about, 0.7),
      "-": () => this.zoom(plot, about, 1 / 0.7),
    }[event.key];
    if (!does) return;
    event.preventDefault();
    event.stopPropagation();
    does();
  }
}
