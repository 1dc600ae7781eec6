// What programs see of the page: window.__strapd, numbers as they came.

import { rollPitchYaw } from "./quaternion.js";

export function publish(getters) {
  const shown = { state: "connecting", sensors: {} };
  const define = (name, get) => Object.defineProperty(shown, name, { get });
  for (const [name, get] of Object.entries(getters)) define(name, get);
  for (const name of ["q", "rpy", "seq"]) define(name, () => Object.values(shown.sensors)[0]?.[name] ?? null);
  window.__strapd = shown;
}

// Of a recording what is there of all of it, and what is drawn.
function whole({ sensor, head, span }) {
  if (!sensor.whole) return null;
  const drawn = sensor.drawn(span);
  return {
    samples: sensor.whole.samples, buckets: sensor.whole.total, from: sensor.whole.oldestTime, to: sensor.whole.newestTime,
    head, drawn: drawn.total, isDetail: drawn === sensor.detail, thinning: drawn.thinning(...span),
  };
}

// All of it; of a card that was drawn what it shows is written there.
export function seen(card) {
  const shown = window.__strapd;
  if (!card) return shown;
  const { sensor, id } = card;
  if (!sensor.last && !sensor.whole) {
    delete shown.sensors[id];
    return shown;
  }
  const q = card.shown?.q ?? sensor.last?.q ?? { w: 1, x: 0, y: 0, z: 0 };
  shown.sensors[id] = {
    q, rpy: rollPitchYaw(q), seq: card.shown?.seq ?? sensor.last?.seq, stamp: sensor.last?.stamp,
    error: sensor.error, worst: card.errors().worst, rms: card.errors().rms, whole: whole({ sensor, head: card.head(), span: card.span() }), tips: card.tips, centre: card.centre, scale: card.scale,
    camera: { ...card.view.camera }, points: sensor.history.total, dropped: sensor.dropped,
    plotted: card.plotted, marks: card.marks ?? [], span: card.span(), held: card.held ?? null, time: card.shown?.time ?? sensor.history.newestTime,
  };
  return shown;
}
