// Attitude quaternions {w, x, y, z}, body to world, Hamilton. Angles in rad. Pure.

export const DEGREES = 180 / Math.PI;

export function product(a, b) {
  return {
    w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
    x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
    y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
    z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
  };
}

export function conjugate(q) {
  return { w: q.w, x: -q.x, y: -q.y, z: -q.z };
}

// Body vector [x, y, z] in world axes.
export function rotate(q, v) {
  const { w, x, y, z } = q;
  const tx = 2 * (y * v[2] - z * v[1]);
  const ty = 2 * (z * v[0] - x * v[2]);
  const tz = 2 * (x * v[1] - y * v[0]);
  return [
    v[0] + w * tx + y * tz - z * ty,
    v[1] + w * ty + z * tx - x * tz,
    v[2] + w * tz + x * ty - y * tx,
  ];
}

// Roll, pitch, yaw (z-y'-x''), degrees.
export function rollPitchYaw(q) {
  const { w, x, y, z } = q;
  const sine = Math.max(-1, Math.min(1, 2 * (w * y - z * x)));
  return [
    Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) * DEGREES,
    Math.asin(sine) * DEGREES,
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) * DEGREES,
  ];
}

// A turn by `angle` about the world's z.
export function aboutZ(angle) {
  return { w: Math.cos(angle / 2), x: 0, y: 0, z: Math.sin(angle / 2) };
}

// Attitude `seconds` later at the body rate [x, y, z], rad/s.
export function turned(q, rate, seconds) {
  const half = (Math.hypot(...rate) * seconds) / 2;
  const part = Math.abs(half) > 1e-9 ? (Math.sin(half) / half) * (seconds / 2) : seconds / 2;
  return product(q, { w: Math.cos(half), x: rate[0] * part, y: rate[1] * part, z: rate[2] * part });
}

// Turns another's world into one's own. Worlds of one name are one; else they agree now, in heading only where both
// are level.
export function aligned(ownWorld, own, world, other) {
  if (ownWorld === world) return { w: 1, x: 0, y: 0, z: 0 };
  const whole = product(own, conjugate(other));
  const norm = Math.hypot(whole.w, whole.z);
  const isLevel = ownWorld !== "start" && world !== "start" && (ownWorld === "ned") === (world === "ned");
  return isLevel && norm > 1e-6 ? { w: whole.w / norm, x: 0, y: 0, z: whole.z / norm } : whole;
}

// Angle of the rotation from a to b, exact down to zero.
export function angleBetween(a, b) {
  const d = product(conjugate(a), b);
  return 2 * Math.atan2(Math.hypot(d.x, d.y, d.z), Math.abs(d.w));
}

// Between a and b, `part` of the way along the shorter arc.
export function between(a, b, part) {
  const dot = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
  const angle = Math.acos(Math.min(1, Math.abs(dot)));
  let from = 1 - part;
  let to = part;
  if (angle > 1e-6) {
    from = Math.sin(from * angle) / Math.sin(angle);
    to = Math.sin(to * angle) / Math.sin(angle);
  }
  if (dot < 0) to = -to;
  return {
    w: from * a.w + to * b.w,
    x: from * a.x + to * b.x,
    y: from * a.y + to * b.y,
    z: from * a.z + to * b.z,
  };
}
