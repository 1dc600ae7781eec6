// A motion made here, for a picture that is the same every time: no daemon is asked.

const RATE = 200;
export const LAST = 10 * RATE;

function coning(t, slip) {
  const [half, turn] = [0.42 + 0.06 * Math.sin(1.3 * t), 1.9 * t];
  const q = {
    w: Math.cos(half / 2),
    x: Math.sin(half / 2) * Math.cos(turn),
    y: Math.sin(half / 2) * Math.sin(turn),
    z: slip,
  };
  const norm = Math.hypot(q.w, q.x, q.y, q.z);
  for (const name of ["w", "x", "y", "z"]) q[name] /= norm;
  const rate = [-0.8 * Math.sin(turn), 0.8 * Math.cos(turn), 0.17 + 0.08 * Math.sin(2.6 * t)];
  return { q, rate };
}

// What the wire would have said, up to number `last` of each sensor.
export function* demonstration(last) {
  for (let seq = 0; seq <= Math.min(last, LAST); seq++) {
    const t = seq / RATE;
    for (const [id, slip] of [["truth", 0], ["imu0", 0.002 * t]]) {
      yield {
        class: "ATT", id, seq, ...coning(t, slip),
        stamp: { sec: 1700000000 + Math.floor(seq / RATE), nsec: (seq % RATE) * (1e9 / RATE) },
        world: "start", body: "flu", sigma_deg: [0.01, 0.01, 0.02], status: ["ok"], reset: 0,
      };
    }
  }
}
