/* Axes, curves and the ball, on canvases that are sharp on any screen. Curves differ in dash and width, not in colour alone. */
"use strict";

const charts = (() => {
  const MARGIN = { left: 58, right: 12, top: 12, bottom: 42 };

  /** Colours of the page, light or dark. */
  function colours(element) {
    const style = getComputedStyle(element);
    const pick = (name, other) => style.getPropertyValue(name).trim() || other;
    return {
      ink: pick("--play-ink", "#1a1a1a"), soft: pick("--play-soft", "#767676"), grid: pick("--play-grid", "#e2e2e2"),
      law: pick("--play-law", "#0b4f9e"), rigid: pick("--play-rigid", "#b35c00"), paper: pick("--play-paper", "#ffffff"),
    };
  }

  /** A canvas's context in CSS pixels, cleared. */
  function begin(canvas) {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = `13px ${getComputedStyle(canvas).fontFamily}`;
    context.lineJoin = "round";
    return { context, width, height, colour: colours(canvas) };
  }

  /** Round numbers between low and high, some `count` of them. */
  function ticks(low, high, count) {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= raw);
    const out = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) out.push(i * step);
    return { values: out, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
  }

  /** Frame, grid, numbers and names of both axes; returns the maps from values to pixels. */
  function axes(canvas, xRange, yRange, xName, yName) {
    const page = begin(canvas), { context, width, height, colour } = page;
    const right = width - MARGIN.right, bottom = height - MARGIN.bottom;
    const x = (value) => MARGIN.left + ((value - xRange[0]) / (xRange[1] - xRange[0])) * (right - MARGIN.left);
    const y = (value) => bottom - ((value - yRange[0]) / (yRange[1] - yRange[0])) * (bottom - MARGIN.top);
    context.lineWidth = 1;
    context.textAlign = "center";
    context.textBaseline = "top";
    const across = ticks(xRange[0], xRange[1], width < 420 ? 4 : 7), up = ticks(yRange[0], yRange[1], 5);
    for (const value of across.values) {
      rule(context, colour.grid, x(value), MARGIN.top, x(value), bottom);
      context.fillStyle = colour.ink;
      context.fillText(value.toFixed(across.digits), x(value), bottom + 5);
    }
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const value of up.values) {
      const zero = Math.abs(value) < 1e-12;
      rule(context, zero ? colour.soft : colour.grid, MARGIN.left, y(value), right, y(value));
      context.fillStyle = colour.ink;
      context.fillText(value.toFixed(up.digits), MARGIN.left - 6, y(value));
    }
    context.strokeStyle = colour.soft;
    context.strokeRect(MARGIN.left, MARGIN.top, right - MARGIN.left, bottom - MARGIN.top);
    context.fillStyle = colour.ink;
    context.textAlign = "center";
    context.textBaseline = "bottom";
    context.fillText(xName, (MARGIN.left + right) / 2, height - 2);
    context.save();
    context.translate(13, (MARGIN.top + bottom) / 2);
    context.rotate(-Math.PI / 2);
    context.textBaseline = "middle";
    context.fillText(yName, 0, 0);
    context.restore();
    return { ...page, x, y, left: MARGIN.left, right, top: MARGIN.top, bottom };
  }

  function rule(context, colour, x0, y0, x1, y1) {
    context.strokeStyle = colour;
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x1, y1);
    context.stroke();
  }

  /** A curve through points, clipped to the frame. */
  function curve(plot, xs, ys, colour, width = 2, dash = []) {
    const { context } = plot;
    context.save();
    context.beginPath();
    context.rect(plot.left, plot.top, plot.right - plot.left, plot.bottom - plot.top);
    context.clip();
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.beginPath();
    for (let i = 0; i < xs.length; i++) context.lineTo(plot.x(xs[i]), plot.y(ys[i]));
    context.stroke();
    context.restore();
  }

  /** The area between a curve and zero. */
  function area(plot, xs, ys, colour) {
    const { context } = plot;
    context.globalAlpha = 0.55;
    context.fillStyle = colour;
    context.beginPath();
    context.moveTo(plot.x(xs[0]), plot.y(0));
    for (let i = 0; i < xs.length; i++) context.lineTo(plot.x(xs[i]), plot.y(ys[i]));
    context.lineTo(plot.x(xs[xs.length - 1]), plot.y(0));
    context.fill();
    context.globalAlpha = 1;
  }

  /** A ring where the present setting is. */
  function mark(plot, x, y, colour, radius = 6) {
    const { context } = plot;
    context.beginPath();
    context.arc(plot.x(x), plot.y(y), radius, 0, 2 * Math.PI);
    context.fillStyle = plot.colour.paper;
    context.fill();
    context.strokeStyle = colour;
    context.lineWidth = 3;
    context.stroke();
  }

  /** A ball, half of it dark so that its turning shows; outlined and dashed: the ghost with rigid friction. */
  function ball(context, x, y, radius, angle, colour, ghost) {
    context.save();
    context.translate(x, y);
    context.lineWidth = 2;
    context.strokeStyle = colour;
    context.setLineDash(ghost ? [4, 3] : []);
    context.beginPath();
    context.arc(0, 0, radius, 0, 2 * Math.PI);
    context.stroke();
    context.rotate(angle);
    context.fillStyle = colour;
    context.globalAlpha = ghost ? 0.3 : 0.9;
    context.beginPath();
    context.arc(0, 0, radius, -Math.PI / 2, Math.PI / 2);
    context.closePath();
    context.fill();
    context.restore();
  }

  return { area, axes, ball, begin, curve, mark, rule };
})();
