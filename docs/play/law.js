/* The law in a small script: one oblique impact of a ball, with stick and slip inside the contact.
 *
 * Scaled as in `contactlaw.rebound`: m = V_z1 = 1 and P = delta^1.5, psi' = -2 chi F/mu. The contact is a line of
 * springs (method of dimensionality reduction), each with its own Coulomb cap, |q| <= delta - x^2. The normal motion is
 * known in closed form, as in contactlaw/laws/oscillator.py and normal_motion.py; the springs are those of
 * contactlaw/laws/microslip.py. tests/test_playground.py compares this file with the package.
 */
"use strict";

const contactlaw = (() => {
  // 5-point Gauss-Legendre on [0, 1].
  const GAUSS = [
    [0.04691007703066802, 0.11846344252809454], [0.23076534494715845, 0.23931433524968324],
    [0.5, 0.28444444444444444], [0.7692346550528415, 0.23931433524968324], [0.953089922969332, 0.11846344252809454],
  ];
  const TIME_PER_PHASE = 0.8 * 1.25 ** 0.4;

  /** Phase at which the contact force falls to zero, for a damping ratio zeta. */
  function endPhase(zeta) {
    if (Math.abs(zeta - 1) < 1e-6) return 2 - (2 / 3) * (zeta - 1);
    if (zeta < 1) return (2 * Math.acos(zeta)) / Math.sqrt(1 - zeta * zeta);
    return (2 * Math.acosh(zeta)) / Math.sqrt((zeta - 1) * (zeta + 1));
  }

  /** Damping ratio that gives the restitution e: exp(-zeta endPhase(zeta)) = e. */
  function dampingRatio(e) {
    if (e >= 1) return 0;
    let low = 0, high = 1 + 1 / Math.sqrt(e);
    for (let i = 0; i < 80; i++) {
      const middle = 0.5 * (low + high);
      if (Math.exp(-middle * endPhase(middle)) > e) low = middle; else high = middle;
    }
    return 0.5 * (low + high);
  }

  /** y, proportional to delta^(5/4), and the closing speed at a phase: a damped oscillator. */
  function phasePoint(theta, zeta) {
    let s = theta, c = 1;
    if (zeta < 1 - 1e-6) {
      const omega = Math.sqrt(1 - zeta * zeta);
      s = Math.sin(omega * theta) / omega;
      c = Math.cos(omega * theta);
    } else if (zeta > 1 + 1e-6) {
      const omega = Math.sqrt((zeta - 1) * (zeta + 1));
      s = Math.sinh(omega * theta) / omega;
      c = Math.cosh(omega * theta);
    }
    const fade = Math.exp(-zeta * theta);
    return [fade * s, fade * (c - zeta * s)];
  }

  /** Time between two phases: the integral of y^(-1/5); a fifth power takes the singularity at an end. */
  function timeOfPhases(start, end, zeta) {
    const length = end - start, last = endPhase(zeta);
    let total = 0;
    for (const [s, w] of GAUSS) {
      let theta = start + length * s, weight = 1;
      if (start < 0.5 * length) {
        theta = start + length * s ** 5;
        weight = 5 * s ** 4;
      } else if (zeta === 0 && end >= last - 1e-12) {
        theta = end - length * s ** 5;
        weight = 5 * s ** 4;
      }
      total += w * weight * Math.max(phasePoint(theta, zeta)[0], 1e-300) ** -0.2;
    }
    return TIME_PER_PHASE * total * length;
  }

  /** The normal motion of an impact at steps + 1 instants; it does not feel the tangential one. */
  function normalMotion(restitution, steps) {
    const zeta = dampingRatio(restitution), end = endPhase(zeta);
    const make = () => new Float64Array(steps + 1);
    const motion = { steps, delta: make(), force: make(), drop: make(), time: make(), step: make() };
    let before = 1;
    for (let k = 0; k <= steps; k++) {
      const theta = (end * k) / steps, next = (end * (k + 1)) / steps;
      const [y, v] = phasePoint(theta, zeta);
      if (k > 0) motion.delta[k] = (Math.sqrt(1.25) * Math.max(y, 0)) ** 0.8;
      if (k > 0 && k < steps) motion.force[k] = (Math.max(y + 2 * zeta * v, 0) / y) * motion.delta[k] ** 1.5;
      const after = k < steps ? phasePoint(0.5 * (theta + next), zeta)[1] : v;
      motion.drop[k] = before - after;
      if (k < steps) {
        motion.step[k] = timeOfPhases(theta, next, zeta);
        motion.time[k + 1] = motion.time[k] + motion.step[k];
      }
      before = after;
    }
    return motion;
  }

  /** Gauss-Legendre points and weights on [0, 1]: the springs on half the contact line. */
  function springs(count) {
    const x = new Float64Array(count), w = new Float64Array(count);
    for (let i = 0; i < count; i++) {
      let root = Math.cos((Math.PI * (i + 0.75)) / (count + 0.5)), slope = 1;
      for (let turn = 0; turn < 50; turn++) {
        let one = 1, two = 0;
        for (let j = 0; j < count; j++) [one, two] = [((2 * j + 1) * root * one - j * two) / (j + 1), one];
        slope = (count * (root * one - two)) / (root * root - 1);
        const change = one / slope;
        root -= change;
        if (Math.abs(change) < 1e-15) break;
      }
      x[i] = 0.5 * (1 - root);
      w[i] = 1 / ((1 - root * root) * slope * slope);
    }
    return { x, w };
  }

  /** One impact: psi after it. `track`, if given, receives {share, psi, deflection} of every instant. */
  function impact(psi1, chi, motion, line, track) {
    const { x, w } = line, n = x.length, deepest = motion.delta.reduce((a, b) => Math.max(a, b), 0);
    const place = x.map((value) => value * value * deepest), q = new Float64Array(n);
    let psi = psi1, slide = 0, share = Math.max(-1, Math.min(1, psi1));
    for (let k = 0; k <= motion.steps; k++) {
      if (k > 0 && k < motion.steps) {
        const delta = motion.delta[k], gained = delta - motion.delta[k - 1];
        let pull = 0, load = 0;
        for (let i = 0; i < n; i++) {
          const cap = Math.max(delta - place[i], 0);
          const part = gained > 0 ? Math.min(cap / gained, 1) : 1; // one that enters takes part from then on
          q[i] = Math.max(-cap, Math.min(cap, q[i] + part * slide));
          pull += w[i] * q[i];
          load += w[i] * cap;
        }
        share = pull / load;
      }
      if (track) track.push({ share, psi, deflection: q.slice() });
      psi -= 2 * chi * share * motion.drop[k];
      slide = psi * motion.step[k];
    }
    return psi;
  }

  /** psi after an impact with rigid (Coulomb) friction: it rolls away or slides to the end. */
  function rigid(psi1, chi, restitution) {
    const most = 2 * chi * (1 + restitution);
    return Math.sign(psi1) * Math.max(Math.abs(psi1) - most, 0);
  }

  /* Materials of contactlaw.MATERIALS: E [Pa], nu, rho [kg/m^3]; ball and floor are of the same one. */
  const MATERIALS = {
    steel: [2.034e11, 0.28, 7833], glass: [7.0e10, 0.25, 2500], aluminium: [7.0e10, 0.33, 2700],
    alumina: [3.8e11, 0.23, 4000], "cellulose acetate": [3.2e9, 0.28, 1319], rubber: [4.0e6, 0.5, 1100],
  };

  /** Units of an impact of a solid ball of radius [m] with approach speed [m/s]. */
  function ball(material, radius, approach) {
    const [modulus, nu, density] = MATERIALS[material];
    const mass = ((4 * Math.PI) / 3) * density * radius ** 3, kappa = (2 * (1 - nu)) / (2 - nu);
    const k = (4 / 3) * (modulus / (2 * (1 - nu * nu))) * Math.sqrt(radius);
    const length = (mass * approach ** 2 / k) ** 0.4;
    return { mass, kappa, chi: 1.75 * kappa, length, time: length / approach, force: mass * approach ** 2 / length };
  }

  return { MATERIALS, ball, dampingRatio, endPhase, impact, normalMotion, rigid, springs };
})();

if (typeof module !== "undefined") module.exports = contactlaw;
