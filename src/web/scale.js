// What a plot says at its edges: round steps, and a scale that does not tremble. Pure.

// Round steps of time from 10 s on.
const MINUTES = [10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 21600];

// Round steps of a scale from `low` to `high`.
export function ticks(low, high, most, { isTime = false } = {}) {
  const rough = (high - low) / most;
  const size = 10 ** Math.floor(Math.log10(rough));
  const decimal = [1, 2, 5, 10].map((n) => n * size).find((s) => s >= rough * 0.999) ?? 10 * size;
  const step = (isTime && rough > 5 && MINUTES.find((s) => s >= rough * 0.999)) || decimal;
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return { step, at: Array.from({ length: Math.max(0, last - first + 1) }, (_, n) => (first + n) * step) };
}

// Digits after the point that tell steps of this size apart.
export const digitsOf = (step, most = 6) => Math.max(0, Math.min(most, -Math.floor(Math.log10(step) + 1e-9)));

export function spoken(value, step) {
  const text = Math.abs(value) >= 1e5 ? value.toExponential(1) : value.toFixed(digitsOf(step));
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
}

// A scale that does not shrink at once when a peak has left.
export class Scale {
  constructor(least) {
    this.least = least;
    this.reset();
  }

  reset() {
    this.low = NaN;
    this.high = NaN;
  }

  // An angle that goes around fills its circle at most.
  follow(low, high, wraps) {
    if (wraps && high - low > 150) {
      [this.low, this.high] = [-180, 180];
      return;
    }
    if (!(high >= low)) [low, high] = [-this.least / 2, this.least / 2];
    const room = Math.max(this.least - (high - low), (high - low) * 0.12, 0) / 2;
    const { at, step } = ticks(low - room, high + room, 4);
    const [from, to] = [Math.min(low - room, at[0] ?? low), Math.max(high + room, at.at(-1) ?? high)];
    const fits = from >= this.low - step && to <= this.high + step && low >= this.low && high <= this.high;
    const wasteful = this.high - this.low === 360 || this.high - this.low > 2.5 * (to - from);
    if (!fits || wasteful) [this.low, this.high] = [from, to];
  }
}
