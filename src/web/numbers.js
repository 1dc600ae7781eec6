// Numbers as people read them: fixed width, a true minus, the whole value for programs.

export function fixed(value, digits) {
  if (!Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

// Digits after the point that mean something beside a sigma: none of an angle under a sigma of 2 degrees.
export const meaning = (sigma, most = 4, unknown = 2) =>
  sigma > 0 ? Math.max(0, Math.min(most, -Math.floor(Math.log10(sigma) + 1e-9))) : unknown;

// A sigma: two digits of one below 10.
export const sigma = (value) => fixed(value, value >= 10 ? 0 : meaning(value) + 1);

// An angle that is an error: three digits, however small it is.
export function error(value) {
  if (!(Math.abs(value) < 1e-4) || value === 0) return fixed(value, Math.min(4, meaning(Math.abs(value), 4, 0) + 2));
  return value.toExponential(1).replaceAll("-", "−");
}

// Into a <data> element: what is read, and all of its digits.
export function show(element, value, digits) {
  const text = typeof digits === "function" ? digits(value) : fixed(value, digits);
  if (element.textContent !== text) element.textContent = text;
  const whole = Number.isFinite(value) ? String(value) : "";
  if (element.value !== whole) element.value = whole;
}

export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

// Three or four digits of a quantity that is not negative, with its unit.
export function measure(value, units) {
  if (!Number.isFinite(value)) return "–";
  if (value < 1e-9) return `0 ${units[0][1]}`;
  const [factor, unit] = units.find(([f]) => value >= f) ?? units.at(-1);
  const scaled = value / factor;
  return `${scaled >= 100 ? scaled.toFixed(0) : scaled >= 10 ? scaled.toFixed(1) : scaled.toFixed(2)} ${unit}`;
}

export const SECONDS = [[1, "s"], [1e-3, "ms"], [1e-6, "µs"], [1e-9, "ns"]];

export function whole(value) {
  return Number.isFinite(value) ? value.toLocaleString("en").replaceAll(",", "\u2009") : "–";
}

// A name from outside: what would steer the direction of the text, or is not seen, is shown and not obeyed.
export function plain(name) {
  return name.replace(/[\p{Cc}\p{Cf}\p{Zl}\p{Zp}]/gu, (c) => `\\u{${c.codePointAt(0).toString(16)}}`);
}
