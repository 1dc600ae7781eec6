// What a card says in words and numbers.

import { clockTime } from "./clock.js";
import { error, fixed, meaning, measure, plain, say, SECONDS, show, sigma as asSigma, whole } from "./numbers.js";
import { rollPitchYaw } from "./quaternion.js";
import { taken } from "./sensor.js";

// What a status may say without a need to be looked at.
const USUAL = new Set(["ok", "provisional", "aided", "rest"]);

// Findings that a card shows: more are in STATUS.
const DOUBTS = 3;

// Of the newest, as it came; of an instant that is looked at, what was kept of it.
function moment({ sensor, held, shown }) {
  const { last } = sensor;
  if (held) return { ...held.at, isHeld: true };
  if (shown) return { ...shown, isHeld: true };
  const { history } = sensor;
  const newest = history.sample(history.total - 1);
  const sigma = [0, 1, 2].map((axis) => last.sigma_deg?.[axis] ?? NaN);
  return { ...newest, q: last.q, angle: rollPitchYaw(last.q), sigma, seq: last.seq, error: sensor.error, isHeld: false };
}

// One sigma of tilt and of heading, as far as they are known: of the attitude itself, else as STATUS tells.
function sigmas({ known }, { sigma, isHeld }) {
  const { tilt, heading } = (isHeld ? null : known.attitude?.sigma_deg) ?? {};
  const own = Math.max(...sigma);
  return [tilt ?? own, heading ?? own];
}

export function writeNumbers(card, heading) {
  const { parts, sensor, view } = card;
  const { last } = sensor;
  const now = moment(card);
  const angles = now.isHeld ? rollPitchYaw(now.q) : now.angle;
  const [tilt, north] = sigmas(card, now);
  // A sigma of degrees, in quaternions: half of it in radians.
  const digits = meaning(Math.min(tilt, north) / 115, 6, 4);
  for (const name of ["w", "x", "y", "z"]) show(parts[`q${name}`], now.q[name], Math.max(3, digits));
  show(parts.roll, angles[0], meaning(tilt));
  show(parts.pitch, angles[1], meaning(tilt));
  show(parts.yaw, view.yaw ? heading : angles[2], meaning(north));
  say(parts.yawName, view.yaw ? "yaw, zeroed" : "yaw");
  card.element.classList.toggle("zeroed", view.yaw !== 0);
  for (const [n, name] of ["x", "y", "z"].entries()) {
    show(parts[`rate${name}`], now.rate[n], 2);
    show(parts[`sigma${name}`], now.sigma[n], asSigma);
  }
  show(parts.speed, Math.hypot(...now.rate), 2);
  say(parts.seq, whole(now.seq));
  parts.seq.value = String(now.seq);
  const flags = now.isHeld ? [] : (last?.status ?? []).filter((flag) => !USUAL.has(flag));
  // Who had ended, and alone began its clock, is at no time.
  say(parts.stamp, flags.includes("last") && now.time === 0 ? "–" : clockTime(now.time, 3));
  say(parts.flags, flags.join(" "));
  parts.flags.title = flags.includes("last") ? "The last there was when this page came; none since." : "";
  say(parts.held, card.held ? `at ${clockTime(now.time, 3)}` : "");
  say(parts.frame, `${sensor.bodyAxes} → ${sensor.world}`);
  if (card.against) {
    show(parts.error, now.error, error);
    show(parts.worst, card.errors().worst, error);
    show(parts.rms, card.errors().rms, error);
  }
  const [from, to] = card.span();
  const part = sensor.whole ? sensor.drawn([from, to]).thinning(from, to) : sensor.thinning;
  const isAll = part < 1.0005;
  say(parts.thinning, isAll ? "every sample" : `1 of ${Number(part.toFixed(part < 10 ? 1 : 0))} samples`);
  parts.thinning.title = isAll
    ? "Everything the daemon made is in the plots."
    : sensor.whole
      ? "Each point holds the least and the greatest of so many samples; zoom in for every one."
      : "The daemon thins what it sends here; peaks between those samples are not in the plots.";
  say(parts.dropped, sensor.dropped ? `${whole(sensor.dropped)} dropped on the way` : "");
  const spoken = angles.map((a) => fixed(a, 0));
  parts.body.setAttribute("aria-label", `Body axes of ${card.name}: roll ${spoken[0]}, pitch ${spoken[1]}, yaw ${spoken[2]} degrees`);
  parts.horizon.setAttribute("aria-label", `Horizon: roll ${spoken[0]}, pitch ${spoken[1]} degrees`);
  sliders(card, now, angles);
}

// What those hear who do not see the plots.
function sliders(card, now, angles) {
  const { parts } = card;
  const [from, to] = card.span();
  const at = now.isHeld ? clockTime(now.time, 3) : "newest";
  const list = (values, names, digits) => names.map((name, n) => `${name} ${fixed(values[n], digits)}`).join(", ");
  const words = {
    rates: `${list(now.rate, ["x", "y", "z"], 2)} degrees a second`,
    angles: `${list(angles, ["roll", "pitch", "yaw"], 1)} degrees`,
    errors: `error ${fixed(now.error, 4)} degrees`,
    accelerations: `${list(now.acceleration, ["x", "y", "z"], 2)} metres a second squared`,
  };
  for (const [name, text] of Object.entries(words)) {
    const set = (attribute, value) => parts[name].setAttribute(`aria-value${attribute}`, value);
    set("min", from.toFixed(3));
    set("max", to.toFixed(3));
    set("now", Math.max(from, Math.min(to, now.time)).toFixed(3));
    set("text", `${at}: ${text}`);
  }
}

// The source as STATUS tells of it; what it does not tell has no place.
export function writeHealth({ parts, sensor }, source, before, seconds) {
  const rate = before && seconds > 0 ? (taken(source) - taken(before)) / seconds : NaN;
  const nominal = source.rate_hz ?? NaN;
  const words = {
    rateNow: Number.isFinite(rate) ? `${whole(Math.round(rate))} Hz` : "–",
    jitter: measure(source.jitter_s ?? sensor.jitter, SECONDS),
    method: source.method,
  };
  say(parts.rateNominal, Number.isFinite(nominal) ? `of ${whole(Math.round(nominal * 10) / 10)}` : "");
  const { counts } = source;
  const cells = {
    gaps: source.gaps,
    // JSON has no NaN: a sender's becomes null.
    nan: counts && (counts.not_finite ?? 0) + (counts.no_gyro ?? 0),
    lost: source.lost,
    missing: source.missing,
  };
  for (const [name, value] of Object.entries(cells)) {
    words[name] = value === undefined || value === null ? undefined : whole(value);
    parts[name].closest("div").classList.toggle("bad", value > 0);
  }
  for (const [name, text] of Object.entries(words)) {
    say(parts[name], text ?? "–");
    parts[name].closest("div").hidden = text === undefined;
  }
}

// What is wrong with the samples, and what helps: the worst first, as STATUS has them.
export function writeDoubts(list, findings) {
  const shown = findings.filter(({ severity }) => severity !== "note").slice(0, DOUBTS);
  list.hidden = shown.length === 0;
  const written = JSON.stringify(shown.map(({ code, what }) => [code, what]));
  if (list.dataset.written === written) return;
  list.dataset.written = written;
  list.replaceChildren(
    ...shown.map(({ severity, what, advice, flags }) => {
      const item = document.createElement("li");
      item.classList.toggle("bad", severity === "error");
      const [title, help] = ["b", "span"].map((tag) => document.createElement(tag));
      say(title, plain(what));
      say(help, plain(flags ? `${advice}: ${flags}` : advice));
      item.append(title, help);
      return item;
    }),
  );
}
