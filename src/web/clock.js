// Instants -> seconds on the clock of the log, and how they are read.

// Seconds between stamps of a recording from which on they are of different clocks: that of a phone counts from its start.
const APART = 86400;
// Seconds between the first stamp of a live sensor and the newest of the others from which on its clock is another.
const LATE = 60;

// Differences before they become one float: nanoseconds survive.
export const secondsBetween = (from, to) => to.sec - from.sec + (to.nsec - from.nsec) * 1e-9;

export function later(stamp, by) {
  const whole = Math.floor(by);
  const nsec = stamp.nsec + Math.round((by - whole) * 1e9);
  return { sec: stamp.sec + whole + Math.floor(nsec / 1e9), nsec: nsec % 1e9 };
}

// 62.5 is 1:02.5, with hours where there are some.
export function clockTime(value, digits = 1) {
  if (!Number.isFinite(value)) return "–";
  // Rounded first: 59.96 s are a minute.
  const unit = 10 ** digits;
  const units = Math.round(Math.abs(value) * unit);
  const rest = ((units % (60 * unit)) / unit).toFixed(digits).padStart(digits ? digits + 3 : 2, "0");
  const minutes = Math.floor(units / (60 * unit));
  const hours = Math.floor(minutes / 60);
  const before = hours ? `${hours}:${String(minutes % 60).padStart(2, "0")}` : String(minutes);
  return `${value < 0 && units ? "−" : ""}${before}:${rest}`;
}

// One clock for all whose stamps are near each other; its zero is the start of the recording, or the first that came.
export class Clocks {
  constructor() {
    this.begin(null);
  }

  begin(epoch) {
    this.isRecording = Boolean(epoch);
    this.all = epoch ? [{ epoch, newest: NaN }] : [];
  }

  of(stamp) {
    // Live, those who speak are near the newest: who ended long ago, or counts from elsewhere, moves no axis of theirs.
    const away = ({ epoch, newest }) => secondsBetween(epoch, stamp) - (this.isRecording ? 0 : newest || 0);
    const known = this.all.find((clock) => Math.abs(away(clock)) < (this.isRecording ? APART : LATE));
    if (known) return known;
    const made = { epoch: stamp, newest: NaN };
    this.all.push(made);
    return made;
  }

  // The newest of each, of these sensors.
  update(sensors) {
    for (const clock of this.all) clock.newest = NaN;
    for (const { clock, history } of sensors) {
      if (clock && !(history.newestTime <= clock.newest)) clock.newest = history.newestTime;
    }
  }
}
