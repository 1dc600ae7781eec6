// Artificial horizon: made from where up is in body axes, so it holds in every world and attitude.

import { fixed } from "./numbers.js";
import { conjugate, DEGREES, rotate } from "./quaternion.js";
import { FONT } from "./surface.js";

// Degrees of pitch from the middle to the rim.
const REACH = 45;

export function drawHorizon(surface, colours, q, world, heading) {
  const context = surface.begin();
  const radius = Math.max(0, Math.min(surface.width, surface.height) / 2 - 2);
  const [cx, cy] = [surface.width / 2, surface.height / 2];
  const down = world === "ned" ? -1 : 1;
  const inBody = rotate(conjugate(q), [0, 0, down]);
  // Forward, right, up of the body: FLU, or FRD in a world that points down.
  const [forward, right, up] = [inBody[0], -inBody[1] * down, inBody[2] * down];
  const pitch = Math.asin(Math.max(-1, Math.min(1, forward))) * DEGREES;
  const bank = Math.atan2(right, up);
  const perDegree = radius / REACH;

  context.save();
  context.beginPath();
  context.arc(cx, cy, radius, 0, 2 * Math.PI);
  context.clip();
  context.translate(cx, cy);
  context.rotate(bank);
  const level = Math.max(-radius, Math.min(radius, pitch * perDegree));
  context.fillStyle = colours.sky;
  context.fillRect(-2 * radius, -2 * radius, 4 * radius, 4 * radius);
  context.fillStyle = colours.ground;
  context.fillRect(-2 * radius, level, 4 * radius, 4 * radius);
  context.strokeStyle = colours.text;
  context.lineWidth = 1.25;
  context.beginPath();
  context.moveTo(-2 * radius, level);
  context.lineTo(2 * radius, level);
  context.stroke();
  context.fillStyle = colours.text;
  context.font = `10px ${FONT}`;
  context.textBaseline = "middle";
  context.lineWidth = 1;
  context.globalAlpha = 0.75;
  for (let mark = -90; mark <= 90; mark += 10) {
    const y = (pitch - mark) * perDegree;
    if (mark === 0 || Math.abs(y) > radius * 0.62) continue;
    const half = radius * (mark % 20 === 0 ? 0.26 : 0.14);
    context.beginPath();
    context.moveTo(-half, y);
    context.lineTo(half, y);
    context.stroke();
    if (mark % 20) continue;
    context.textAlign = "right";
    context.fillText(String(Math.abs(mark)), -half - 4, y);
    context.textAlign = "left";
    context.fillText(String(Math.abs(mark)), half + 4, y);
  }
  // The bank scale turns with the horizon, the pointer stays.
  for (const mark of [-60, -45, -30, -20, -10, 0, 10, 20, 30, 45, 60]) {
    const a = (mark - 90) / DEGREES;
    const inner = radius * (mark % 30 === 0 ? 0.88 : 0.92);
    context.beginPath();
    context.moveTo(inner * Math.cos(a), inner * Math.sin(a));
    context.lineTo(radius * Math.cos(a), radius * Math.sin(a));
    context.stroke();
  }
  context.restore();

  context.strokeStyle = colours.text;
  context.lineWidth = 2.5;
  context.beginPath();
  context.moveTo(cx - radius * 0.5, cy);
  context.lineTo(cx - radius * 0.2, cy);
  context.lineTo(cx - radius * 0.12, cy + radius * 0.09);
  context.moveTo(cx + radius * 0.5, cy);
  context.lineTo(cx + radius * 0.2, cy);
  context.lineTo(cx + radius * 0.12, cy + radius * 0.09);
  context.stroke();
  context.fillStyle = colours.text;
  context.beginPath();
  context.arc(cx, cy, 2.5, 0, 2 * Math.PI);
  context.fill();
  context.beginPath();
  context.moveTo(cx, cy - radius * 0.86);
  context.lineTo(cx - 5, cy - radius * 0.86 + 8);
  context.lineTo(cx + 5, cy - radius * 0.86 + 8);
  context.fill();

  const words = `${fixed(heading, 0)}°`;
  context.font = `600 11px ${FONT}`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  const width = 44;
  context.globalAlpha = 0.85;
  context.fillStyle = colours.surface;
  context.fillRect(cx - width / 2, cy + radius * 0.68, width, 17);
  context.globalAlpha = 1;
  context.fillStyle = colours.text;
  context.fillText(words, cx, cy + radius * 0.68 + 9);
  context.strokeStyle = colours.line;
  context.lineWidth = 1.5;
  context.beginPath();
  context.arc(cx, cy, radius, 0, 2 * Math.PI);
  context.stroke();
}
