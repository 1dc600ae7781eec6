// What programs see of the page: window.__strapd, numbers as they came.

import { rollPitchYaw } from "./quaternion.js";

export function publish(getters) {
  const shown = { state: "connecting", sensors: {} };
  const define = (name, get) => Object.defineProperty(shown, name, { get });
  for (const [name, get] of Object.entries(getters)) define(name, get);
  for (const name of ["q", "rpy", "seq"]) define(name, () => Object.values(shown.sensors)[0]?.[name] ?? null);
  window.__strapd = shown;
}

// All of it; of a card that was drawn what it shows is written there.
export function seen(card) {
  const shown = window.__strapd;
  if (!card) return shown;
  const { sensor, id } = card;
  if (!sensor.last) {
    delete shown.sensors[id];
    return shown;
  }
  shown.sensors[id] = {
    q: sensor.last.q, rpy: rollPitchYaw(sensor.last.q), seq: sensor.last.seq, stamp: sensor.last.stamp,
    error: sensor.error, worst: sensor.worst, tips: card.tips, centre: card.centre, scale: card.scale,
    camera: { ...card.view.camera }, points: sensor.history.total, dropped: sensor.dropped,
    plotted: card.plotted, span: card.span(), held: card.held ?? null, time: sensor.history.newestTime,
  };
  return shown;
}
