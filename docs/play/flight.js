/* A ball that flies and bounces: parabolas, and an impact wherever it comes down. */
"use strict";

const flight = (() => {
  const GRAVITY = 9.81;

  /** Flights from the top of the way in on: {start, time, x, vx, vz, spin, angle}, bounces at z = 0, lengths in m.
   *
   * after(vx, vz, spin): velocities after an impact with these before it.
   */
  function path(first, after, bounces) {
    const in0 = Math.min(first.vz / GRAVITY, 0.5); // no longer than half a second of way in
    let now = { time: -in0, x: -first.vx * in0, z: 0, vx: first.vx, vz: -(first.vz - GRAVITY * in0), spin: first.spin };
    now.z = first.vz * in0 - 0.5 * GRAVITY * in0 ** 2;
    now.angle = -first.spin * in0;
    const parts = [];
    for (let n = 0; n <= bounces; n++) {
      const duration = n === 0 ? in0 : (2 * now.vz) / GRAVITY;
      parts.push({ ...now, duration });
      const speed = n === 0 ? first.vz : now.vz;
      const next = after(now.vx, speed, now.spin);
      now = { time: now.time + duration, x: now.x + now.vx * duration, z: 0, ...next,
              angle: now.angle + now.spin * duration };
      if (!(next.vz > 0.02)) break;
    }
    return parts;
  }

  /** Where the ball is at an instant. */
  function at(parts, time) {
    let part = parts[0];
    for (const one of parts) if (one.time <= time) part = one;
    const t = Math.min(Math.max(time - part.time, 0), part.duration);
    return { x: part.x + part.vx * t, z: part.z + part.vz * t - 0.5 * GRAVITY * t * t, angle: part.angle + part.spin * t,
             spin: part.spin };
  }

  /** When the last flight ends. */
  function end(parts) {
    const last = parts[parts.length - 1];
    return last.time + last.duration;
  }

  return { at, end, path };
})();
