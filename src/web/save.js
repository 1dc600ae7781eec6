// What is seen -> files: a picture of a card, rows of its samples. Made here, sent nowhere.

import { clockTime, later } from "./clock.js";
import { say } from "./numbers.js";
import { FONT } from "./surface.js";

const PICTURE = ["body", "horizon", "rates", "angles", "errors", "accelerations"];

// A name that every file system takes.
const named = (id, ending) => `strapd-${id.replace(/[^\w.-]+/g, "_").slice(0, 60) || "sensor"}.${ending}`;

function give(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  // It is read after the click.
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const padded = (value) => String(value).padStart(9, "0");

// The samples between the ends of the plots, every digit; what is not known is empty.
// Of a recording those that the plots are made of: of each stretch the first.
export function rows({ sensor }, [from, to]) {
  const { clock } = sensor;
  const history = sensor.drawn([from, to]);
  const head = "stamp_s,time_s,seq,q_w,q_x,q_y,q_z,roll_deg,pitch_deg,yaw_deg,rate_x_dps,rate_y_dps,rate_z_dps,sigma_x_deg,sigma_y_deg,sigma_z_deg,error_deg";
  const more = history.hasAcceleration ? ",world_linear_acceleration_x,world_linear_acceleration_y,world_linear_acceleration_z" : "";
  const lines = [head + more];
  const last = history.firstFrom(to + 1e-9);
  for (let n = history.firstFrom(from - 1e-9); n < last; n++) {
    const { time, seq, q, angle, rate, sigma, error, acceleration } = history.sample(n);
    const stamp = later(clock.epoch, time);
    const values = [time, seq, q.w, q.x, q.y, q.z, ...angle, ...rate, ...sigma, error, ...(more ? acceleration : [])];
    lines.push([`${stamp.sec}.${padded(stamp.nsec)}`, ...values.map((v) => (Number.isFinite(v) ? v : ""))].join(","));
  }
  return `${lines.join("\n")}\n`;
}

export function saveRows(card) {
  give(new Blob([rows(card, card.span())], { type: "text/csv" }), named(card.id, "csv"));
}

// Its canvases as they stand on the page, with a head and the numbers.
export async function savePicture(card, colours) {
  const { parts, surfaces, element } = card;
  const shown = PICTURE.map((name) => surfaces[name]).filter((s) => s.width > 0 && s.canvas.offsetParent);
  const box = element.getBoundingClientRect();
  const ratio = surfaces.body.ratio;
  const canvas = document.createElement("canvas");
  canvas.width = Math.round(box.width * ratio);
  canvas.height = Math.round((shown.reduce((low, s) => Math.max(low, s.canvas.getBoundingClientRect().bottom), box.top + 60) - box.top + 12) * ratio);
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  context.fillStyle = colours.surface;
  context.fillRect(0, 0, box.width, box.height);
  const write = (part, font) => {
    const at = part.getBoundingClientRect();
    context.font = font;
    context.fillStyle = getComputedStyle(part).color;
    context.textBaseline = "middle";
    context.fillText(part.textContent, at.left - box.left, at.top - box.top + at.height / 2);
  };
  write(parts.name, `650 15px ${FONT}`);
  for (const part of element.querySelectorAll(".views th, .views td, .frame, .held, figcaption b, figcaption i, figcaption data")) {
    if (part.offsetParent && part.textContent.trim()) write(part, `${getComputedStyle(part).fontSize} ${FONT}`);
  }
  for (const { canvas: from } of shown) {
    const at = from.getBoundingClientRect();
    context.drawImage(from, at.left - box.left, at.top - box.top, at.width, at.height);
  }
  const [from, to] = card.span();
  context.font = `11px ${FONT}`;
  context.fillStyle = colours.muted;
  context.textAlign = "right";
  context.fillText(`${clockTime(from)} to ${clockTime(to)}`, box.width - 16, 24);
  const blob = await new Promise((done) => canvas.toBlob(done, "image/png"));
  give(blob, named(card.id, "png"));
}

export async function save(card, kind, colours, notice) {
  if (!card.sensor.last && !card.sensor.whole) return notice(`${card.name} has no data yet: there is nothing to save`);
  if (kind === "csv") saveRows(card);
  else await savePicture(card, colours);
  say(card.parts.saved, kind === "csv" ? "rows saved" : "picture saved");
}
