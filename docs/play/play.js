/* The playground: sliders, three charts, and a ball. */
"use strict";

(() => {
  const root = document.getElementById("play-root");
  if (!root) return;
  const RADIUS = 0.025, STEPS = 240, BOUNCES = 4, SLOWER = 3;
  const get = (id) => document.getElementById(`play-${id}`);
  const INPUTS = ["angle", "speed", "spin", "friction", "restitution", "instant"];
  const line = contactlaw.springs(48);
  const state = { running: !matchMedia("(prefers-reduced-motion: reduce)").matches, clock: 0, last: null };

  /* What people throw: angle from the upright [degrees], speed [m/s], spin [rad/s], friction, restitution, material. */
  const THROWS = {
    superball: [40, 1.9, -95, 0.9, 0.9, "rubber"], marble: [30, 2, 0, 0.1, 0.95, "glass"],
    steel: [12, 1, 0, 0.115, 0.93, "steel"], topspin: [35, 3, 240, 0.25, 0.9, "cellulose acetate"],
  };

  /** Numbers that the sliders say. */
  function settings() {
    const out = { material: get("material").value };
    for (const name of INPUTS) out[name] = Number(get(name).value);
    return out;
  }

  /** Everything that follows from the settings. */
  function solve() {
    const now = settings(), tilt = (now.angle * Math.PI) / 180;
    const vx = now.speed * Math.sin(tilt), vz = now.speed * Math.cos(tilt);
    const motion = contactlaw.normalMotion(now.restitution, STEPS);
    const unit = contactlaw.ball(now.material, RADIUS, vz), psi = unit.kappa / now.friction / vz;
    const track = [], psi1 = psi * (vx - RADIUS * now.spin), psi2 = contactlaw.impact(psi1, unit.chi, motion, line, track);
    /* The contact point's change is shared: of 3.5 parts a solid ball puts 1 into its centre and 2.5 into its spin. */
    const after = (rule) => (x, z, spin) => {
      const before = x - RADIUS * spin, scale = unit.kappa / now.friction / z;
      const change = rule(before * scale) / scale - before;
      return { vx: x + change / 3.5, vz: now.restitution * z, spin: spin - (change * 2.5) / 3.5 / RADIUS };
    };
    const first = { vx, vz, spin: now.spin };
    const byLaw = after((value) => contactlaw.impact(value, unit.chi, motion, line));
    const byRigid = after((value) => contactlaw.rigid(value, unit.chi, now.restitution));
    return { now, vx, vz, unit, motion, track, psi1, psi2, out: byLaw(vx, vz, now.spin),
             law: flight.path(first, byLaw, BOUNCES), rigid: flight.path(first, byRigid, BOUNCES) };
  }

  /** psi_2 over psi_1. */
  function drawCurve(view) {
    const { unit, motion, now } = view, side = view.psi1 < 0 ? -1 : 1, psi = Math.abs(view.psi1);
    const slides = Math.max(1, 2 * unit.chi * (1 + now.restitution) - now.restitution);
    const far = Math.max(1.35 * slides, Math.min(1.1 * psi, 40)), xs = [], law = [], rigid = [];
    for (let i = 0; i <= 110; i++) {
      xs.push((far * i) / 110);
      law.push(contactlaw.impact(xs[i], unit.chi, motion, line));
      rigid.push(contactlaw.rigid(xs[i], unit.chi, now.restitution));
    }
    const low = Math.min(...law), high = Math.max(...law, 0.5), pad = 0.08 * (high - low);
    const plot = charts.axes(get("curve"), [0, far], [low - pad, high + pad], "ψ₁, before the impact", "ψ₂, after the impact");
    const { context, colour } = plot;
    context.setLineDash([3, 4]);
    context.lineWidth = 1;
    for (const [value, text] of [[1, "starts stuck"], [slides, "slides throughout"]]) {
      charts.rule(context, colour.soft, plot.x(value), plot.top, plot.x(value), plot.bottom);
      const leftOf = value === 1 || plot.right - plot.x(value) < 130;
      context.save();
      context.fillStyle = colour.soft;
      context.translate(plot.x(value) + (leftOf ? -4 : 4), plot.top + 5);
      context.textBaseline = "top";
      if (value === 1) {
        context.rotate(-Math.PI / 2);
        context.textAlign = "right";
        context.textBaseline = "bottom";
        context.fillText(text, 0, 0);
      } else {
        context.textAlign = leftOf ? "right" : "left";
        context.fillText(text, 0, 0);
      }
      context.restore();
    }
    context.setLineDash([]);
    charts.curve(plot, xs, rigid, colour.rigid, 2, [7, 5]);
    charts.curve(plot, xs, law, colour.law, 2.5);
    if (psi <= far) charts.mark(plot, psi, side * view.psi2, colour.law);
  }

  /** Normal and tangential force over time. */
  function drawForce(view) {
    const { unit, motion, track, now } = view, mu = now.friction;
    const span = 1e6 * unit.time * motion.time[motion.steps], long = span > 2000, scale = (long ? 1e3 : 1e6) * unit.time;
    const times = Array.from(motion.time, (t) => scale * t), normal = Array.from(motion.force, (f) => mu * unit.force * f);
    const pull = track.map((one, k) => one.share * normal[k]), most = Math.max(...normal), kilo = most > 2000 ? 1e3 : 1;
    const name = kilo > 1 ? "force [kN]" : "force [N]";
    const plot = charts.axes(get("force"), [0, times[times.length - 1]], [(-1.12 * most) / kilo, (1.12 * most) / kilo],
                             `time since first contact [${long ? "ms" : "µs"}]`, name);
    const { colour, context } = plot, k = instant(view);
    charts.curve(plot, times, normal.map((f) => f / kilo), colour.soft, 2, [6, 4]);
    charts.curve(plot, times, normal.map((f) => -f / kilo), colour.soft, 2, [6, 4]);
    charts.curve(plot, times, pull.map((f) => f / kilo), colour.law, 2.5);
    context.lineWidth = 1;
    charts.rule(context, colour.ink, plot.x(times[k]), plot.top, plot.x(times[k]), plot.bottom);
    charts.mark(plot, times[k], pull[k] / kilo, colour.law, 5);
  }

  /** Traction of the springs along the contact at one instant. */
  function drawInside(view) {
    const { motion, track, unit } = view, k = instant(view), delta = motion.delta[k];
    const deepest = motion.delta.reduce((a, b) => Math.max(a, b), 0), q = track[k].deflection;
    const micro = 1e6 * Math.sqrt(RADIUS * unit.length), edge = Math.sqrt(deepest), wide = micro * edge > 2000;
    const scale = wide ? micro / 1e3 : micro, xs = [], cap = [], value = [], slip = [];
    for (let i = 0; i < line.x.length; i++) {
      const x = line.x[i] * edge, most = Math.max(delta - x * x, 0);
      xs.push(scale * x);
      cap.push(most / deepest);
      value.push(q[i] / deepest);
      slip.push(most > 0 && Math.abs(q[i]) >= most * (1 - 1e-9));
    }
    const plot = charts.axes(get("inside"), [0, scale * edge], [-1.1, 1.1], `from the middle of the contact [${wide ? "mm" : "µm"}]`,
                             "spring force, over the greatest limit");
    const { colour, context } = plot;
    charts.curve(plot, xs, cap, colour.soft, 2, [6, 4]);
    charts.curve(plot, xs, cap.map((one) => -one), colour.soft, 2, [6, 4]);
    const last = cap.filter((one) => one > 0).length;
    for (let from = 0, to = 1; to < last; to++) {
      if (to + 1 < last && slip[to + 1] === slip[to]) continue; // areas of springs that do the same
      charts.area(plot, xs.slice(from, to + 1), value.slice(from, to + 1), slip[to] ? colour.rigid : colour.law);
      from = to;
    }
    charts.curve(plot, xs.filter((_, i) => cap[i] > 0), value.filter((_, i) => cap[i] > 0), colour.ink, 1.5);
    const slipping = slip.filter(Boolean).length;
    const part = last === 0 ? "apart" : slipping === 0 ? "all stuck" : slipping === last ? "all slipping"
      : `stuck out to ${Number((scale * edge * stuckOut(slip, cap)).toPrecision(2))} ${wide ? "mm" : "µm"}, slipping beyond`;
    get("inside-text").textContent = `Now: ${part}.`;
  }

  /** Outermost stuck spring, over the greatest radius. */
  function stuckOut(slip, cap) {
    let out = 0;
    slip.forEach((one, i) => { if (!one && cap[i] > 0) out = line.x[i]; });
    return out;
  }

  function instant(view) {
    return Math.round((view.now.instant / 100) * view.motion.steps);
  }

  /** The ball by the law and its ghost by rigid friction, at a time. */
  function drawBall(view, time) {
    const { context, width, height, colour } = charts.begin(get("ball")), places = [];
    for (const parts of [view.law, view.rigid]) {
      for (const part of parts) {
        for (let i = 0; i <= 8; i++) places.push(flight.at(parts, part.time + (part.duration * i) / 8 - 1e-9));
      }
    }
    const xs = places.map((p) => p.x), low = Math.min(...xs) - 0.08, high = Math.max(...xs) + 0.08;
    const top = Math.max(...places.map((p) => p.z)) + 0.1, floor = height - 30;
    const scale = Math.min((width - 20) / Math.max(high - low, 0.4), (floor - 8) / Math.max(top, 0.2));
    const middle = (low + high) / 2, x = (value) => width / 2 + (value - middle) * scale, z = (value) => floor - (value + RADIUS) * scale;
    context.fillStyle = colour.grid;
    context.fillRect(0, floor, width, height - floor);
    context.lineWidth = 1;
    charts.rule(context, colour.soft, 0, floor, width, floor);
    const bar = [1, 0.5, 0.2, 0.1, 0.05].find((length) => length * scale < width / 3);
    context.lineWidth = 3;
    charts.rule(context, colour.ink, 12, floor + 16, 12 + bar * scale, floor + 16);
    context.fillStyle = colour.ink;
    context.textBaseline = "middle";
    context.textAlign = "left";
    context.fillText(`${bar} m`, 18 + bar * scale, floor + 16);
    for (const [parts, ink, dash] of [[view.rigid, colour.rigid, [5, 5]], [view.law, colour.law, []]]) {
      context.strokeStyle = ink;
      context.lineWidth = 1.2;
      context.setLineDash(dash);
      context.beginPath();
      for (const part of parts) {
        for (let i = 0; i <= 24; i++) {
          const p = flight.at([part], part.time + (part.duration * i) / 24);
          context.lineTo(x(p.x), z(p.z));
        }
      }
      context.stroke();
      context.setLineDash([]);
    }
    const size = Math.max(RADIUS * scale, 7);
    const ghost = flight.at(view.rigid, time), real = flight.at(view.law, time);
    charts.ball(context, x(ghost.x), z(ghost.z) + RADIUS * scale - size, size, ghost.angle, colour.rigid, true);
    charts.ball(context, x(real.x), z(real.z) + RADIUS * scale - size, size, real.angle, colour.law, false);
  }

  /** A short time or length with its unit. */
  function small(value, unit) {
    return value >= 1e-3 ? `${(1e3 * value).toPrecision(3)} m${unit}` : `${(1e6 * value).toPrecision(3)} µ${unit}`;
  }

  /** The figures in words, and what the sliders say. */
  function write(view) {
    const { now, unit, motion, out } = view, deep = unit.length * motion.delta.reduce((a, b) => Math.max(a, b), 0);
    get("angle-out").textContent = `${now.angle}°`;
    get("speed-out").textContent = `${now.speed.toFixed(1)} m/s`;
    get("spin-out").textContent = `${now.spin} rad/s`;
    get("friction-out").textContent = now.friction.toFixed(2);
    get("restitution-out").textContent = now.restitution.toFixed(2);
    get("instant-out").textContent = `${now.instant} %`;
    const slides = Math.max(1, 2 * unit.chi * (1 + now.restitution) - now.restitution), psi = Math.abs(view.psi1);
    const regime = psi <= 1 ? "starts stuck, slips from the rim inwards"
      : psi < slides ? "slides first, then sticks" : "slides throughout";
    const back = view.psi1 * view.psi2 < 0;
    const cells = {
      psi1: view.psi1.toFixed(3), psi2: view.psi2.toFixed(3), chi: unit.chi.toFixed(3), regime,
      point: `${(view.vx - RADIUS * now.spin).toFixed(2)} → ${(out.vx - RADIUS * out.spin).toFixed(2)} m/s${back ? ", reversed" : ""}`,
      centre: `${view.vx.toFixed(2)} → ${out.vx.toFixed(2)} m/s`, turn: `${now.spin} → ${out.spin.toFixed(0)} rad/s`,
      time: small(unit.time * motion.time[motion.steps], "s"),
      depth: `${small(deep, "m")}, ${((100 * deep) / RADIUS).toPrecision(2)} % of the radius`,
    };
    for (const [name, text] of Object.entries(cells)) get(`out-${name}`).textContent = text;
    get("deep").hidden = deep < 0.1 * RADIUS;
  }

  for (const name of Object.keys(contactlaw.MATERIALS)) get("material").add(new Option(name, name, false, name === "rubber"));
  let view = solve();

  function redraw() {
    view = solve();
    write(view);
    drawCurve(view);
    drawForce(view);
    drawInside(view);
    drawBall(view, view.law[0].time + state.clock);
  }

  function step(now) {
    if (state.running && state.last !== null) {
      const whole = Math.max(flight.end(view.law), flight.end(view.rigid)) - view.law[0].time;
      state.clock = (state.clock + Math.min(now - state.last, 100) / 1000 / SLOWER) % (whole + 0.3);
      drawBall(view, view.law[0].time + state.clock);
    }
    state.last = now;
    requestAnimationFrame(step);
  }

  function pause(running) {
    state.running = running;
    get("pause").textContent = running ? "Pause" : "Play";
  }

  for (const name of [...INPUTS, "material"]) get(name).addEventListener("input", redraw);
  get("pause").addEventListener("click", () => pause(!state.running));
  for (const button of root.querySelectorAll("[data-throw]")) {
    button.addEventListener("click", () => {
      const [angle, speed, spin, friction, restitution, material] = THROWS[button.dataset.throw];
      for (const [name, value] of Object.entries({ angle, speed, spin, friction, restitution, material })) get(name).value = value;
      state.clock = 0;
      redraw();
    });
  }
  new ResizeObserver(redraw).observe(root);
  new MutationObserver(redraw).observe(document.body, { attributes: true, attributeFilter: ["data-md-color-scheme"] });
  pause(state.running);
  redraw();
  requestAnimationFrame(step);
})();
