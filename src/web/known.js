// What a daemon knows of an attitude and of its sensor beside the numbers: tilt and heading with their sigmas, the
// calibration it has learned, rest, the magnetic field. Once a second, from STATUS.

import { fixed, say, show, sigma as asSigma } from "./numbers.js";
import { DEGREES } from "./quaternion.js";
import { FONT } from "./surface.js";

// Sigmas that are drawn.
const SIGMAS = 3;
// Degrees by which a field is another than before.
const ANOTHER = 5.7;
// Milliseconds in which a request must be made a second time.
const SURE = 4000;
const MILLI = 1000;

// Rows of the table: name, unit, the field of STATUS, its factor, digits.
const ROWS = [
  ["gyro bias", "°/s", "gyro_bias_rad_s", DEGREES, 3],
  ["gyro scale", "%", "gyro_scale_ppm", 1e-4, 2],
  ["gyro misalignment xy xz yz", "°", "gyro_cross_rad", DEGREES, 2],
  ["accel bias", "m/s²", "accel_bias_m_s2", 1, 3],
  ["accel time offset", "ms", "accel_lead_s", MILLI, 2],
];

const list = (value) => (Array.isArray(value) ? value : [value]);

// A button that acts at its second click: one is easily made, and every reader of the sensor sees the attitude jump.
export class Twice {
  constructor(button, act) {
    this.button = button;
    button.addEventListener("click", () => {
      clearTimeout(this.timer);
      const sure = this.sure;
      this.wait(!sure);
      if (sure) act();
      else this.timer = setTimeout(() => this.wait(false), SURE);
    });
  }

  wait(sure) {
    this.sure = sure;
    this.button.setAttribute("aria-pressed", String(sure));
    this.name(this.what);
  }

  name(what) {
    this.what = what;
    say(this.button, this.sure ? `${what}: sure?` : what);
  }
}

export class Known {
  constructor(parts, ask) {
    this.parts = parts;
    this.cells = ROWS.map(([name, unit, field]) => {
      const row = parts.learned.insertRow();
      const head = document.createElement("th");
      head.scope = "row";
      head.textContent = `${name}, ${unit}`;
      row.append(head);
      const count = field === "accel_lead_s" ? 1 : 3;
      return Array.from({ length: count }, (_, axis) => {
        const cell = row.insertCell();
        const [value, sigma] = ["data", "small"].map((tag) => document.createElement(tag));
        value.dataset.testid = `${field}-${axis}`;
        cell.append(value, sigma);
        return { value, sigma };
      });
    });
    this.level = new Twice(parts.anew, () => ask(this.attitude?.aided ? { init: "gravity" } : {}));
    this.yaw = new Twice(parts.yawZero, () => ask({ heading: 0 }));
    this.yaw.name("Yaw zero");
  }

  // A source as STATUS tells of it.
  tell(source) {
    const { parts } = this;
    // Of a recording there is nothing to begin anew.
    const isLive = source.resets !== undefined;
    parts.anew.hidden = !isLive;
    const { attitude, aid } = source;
    this.attitude = attitude ?? null;
    this.level.name(attitude?.aided ? "Level here" : "Zero here");
    // By a field, the heading is the field's.
    parts.yawZero.hidden = !isLive || attitude?.aided !== "gravity";
    parts.known.hidden = !attitude || !aid;
    if (parts.known.hidden) return;
    const { sigma_deg: sigma = {}, field } = attitude;
    const by = { gravity: "level by gravity", "gravity+mag": "level by gravity, north by the field" };
    const given = aid.force_implausible ? "not level: the force has no gravity in it" : "not level yet";
    say(parts.aided, attitude.aided ? (by[attitude.aided] ?? attitude.aided) : given);
    parts.aided.classList.toggle("bad", !attitude.aided);
    say(parts.rest, attitude.rest ? "at rest" : "moving");
    show(parts.tiltSigma, sigma.tilt ?? NaN, asSigma);
    show(parts.headingSigma, sigma.heading ?? NaN, asSigma);
    say(parts.corrections, (aid.corrections ?? 0).toLocaleString("en").replaceAll(",", "\u2009"));
    parts.fieldBox.hidden = !field;
    if (field) {
      const doubted = aid.fields_doubted > 0 ? `, ${fixed((100 * aid.fields_doubted) / aid.corrections, 0)} % doubted` : "";
      // Its unit is the sender's.
      const norm = Number.isFinite(field.norm) ? Number(field.norm.toPrecision(3)) : "–";
      say(parts.field, `${norm}, dip ${fixed(field.dip_deg, 1)}°, off ${fixed(field.deviation_deg, 1)}°${doubted}`);
      parts.field.classList.toggle("bad", field.deviation_deg > ANOTHER);
    }
    for (const [n, [, , name, factor, digits]] of ROWS.entries()) {
      const [values, sigmas] = [list(aid.learned?.[name]), list(aid.sigma?.[name])];
      for (const [axis, cell] of this.cells[n].entries()) {
        show(cell.value, (values[axis] ?? NaN) * factor, digits);
        say(cell.sigma, ` ±${fixed((sigmas[axis] ?? NaN) * factor, digits)}`);
      }
    }
  }

  // Where the vertical may be, from above, and the heading: three sigmas of each. `yaw` in degrees; a world
  // whose z points down is seen from above all the same.
  draw(surface, colours, yaw, world) {
    const sigma = this.attitude?.sigma_deg;
    if (this.parts.known.hidden || !sigma || !(surface.width > 0)) return;
    const context = surface.begin();
    const [cx, cy] = [surface.width / 2, surface.height / 2];
    const radius = Math.min(cx, cy) - 13;
    const most = SIGMAS * sigma.tilt;
    const decade = 10 ** Math.floor(Math.log10(Math.max(most, 1e-3)));
    const ring = [1, 2, 5, 10].map((m) => m * decade).find((r) => r >= most) ?? 10 * decade;
    context.strokeStyle = colours.line;
    context.lineWidth = 1;
    for (const part of [0.5, 1]) {
      context.beginPath();
      context.arc(cx, cy, radius * part, 0, 2 * Math.PI);
      context.stroke();
    }
    // Tilted about an axis, the vertical goes across it. Up on the canvas is the world's y.
    const sense = world === "ned" ? 1 : -1;
    const direction = (sense * (sigma.tilt_about - 90)) / DEGREES;
    for (const n of [1, SIGMAS]) {
      const [long, short] = [sigma.tilt, sigma.tilt_least].map((s) => Math.max(1, (radius * n * s) / ring));
      context.beginPath();
      context.ellipse(cx, cy, long, short, direction, 0, 2 * Math.PI);
      context.globalAlpha = 0.22;
      context.fillStyle = colours.z;
      context.fill();
      context.globalAlpha = 1;
      context.strokeStyle = colours.z;
      context.stroke();
    }
    const half = Math.min(180, SIGMAS * sigma.heading) / DEGREES;
    context.strokeStyle = colours.x;
    context.lineWidth = 4;
    context.lineCap = "butt";
    context.beginPath();
    const ahead = (sense * yaw) / DEGREES;
    context.arc(cx, cy, radius + 4, ahead - half, ahead + half);
    context.stroke();
    context.font = `10px ${FONT}`;
    context.fillStyle = colours.muted;
    context.textAlign = "center";
    context.textBaseline = "bottom";
    context.fillText(`${Number(ring.toPrecision(1))}°`, cx, cy + radius - 2);
  }
}
