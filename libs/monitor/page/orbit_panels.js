// The path of the shaft: orbit, phase plane, and the 1X vector in its plane.
import { store, channelIndex } from "./store.js";
import { unitFor, digits, largest, ticks, lags } from "./units.js";
import { prepare, plotBox, axes, clipped, curve, marks, label, empty, line, machine, colors, seriesColor } from "./canvas.js";

const byId = (id) => document.getElementById(id);
const TURN = 2 * Math.PI, FINE = 1.5; // px between points of a path

/** The last `seconds` of raw samples of these channels, joined. */
function recent(indices, seconds) {
  const parts = store.recent.map((c) => [c, Math.min(c.n, Math.max(0, Math.floor((store.time - seconds - c.t) / c.dt)))]);
  const size = parts.reduce((sum, [c, from]) => sum + c.n - from, 0);
  const data = indices.map((index) => {
    const joined = new Float32Array(size).fill(NaN);
    let at = 0;
    for (const [c, from] of parts) {
      if (index >= 0) joined.set(c.data[index].subarray(from), at);
      at += c.n - from;
    }
    return joined;
  });
  return { data, dt: parts.length ? parts[parts.length - 1][0].dt : 0 };
}
const seconds = () => Number(byId("orbit-span").value);

/** Equal scales of both axes around zero, for values up to `size`. */
function squareAxes(g, w, h, size, xName, yName) {
  const [factor, unit] = unitFor("displacement", "m", size), box = plotBox(w, h);
  const perPixel = 1.1 * (size || 1e-6) / factor / (0.5 * Math.min(box.w, box.h));
  const limitX = perPixel * 0.5 * box.w, limitY = perPixel * 0.5 * box.h;
  const [fx, fy] = axes(g, box, { low: -limitX, high: limitX, label: `${xName} [${unit}]` }, { low: -limitY, high: limitY, label: `${yName} [${unit}]` });
  return [box, (v) => fx(v / factor), (v) => fy(v / factor), factor, unit];
}

function drawOrbit() {
  const [g, w, h] = prepare(byId("orbit")), names = store.stream.orbit;
  if (names.length < 2) return empty(g, w, h, "needs the displacements x and y");
  const beta = channelIndex("beta"), { data: [x, y, angle] } = recent([channelIndex(names[0]), channelIndex(names[1]), beta], seconds());
  if (x.length < 3) return empty(g, w, h, "no samples yet");
  const turn = store.turns[store.turns.length - 1], filtered = byId("orbit-1x").checked && turn && turn.vectors.length > 1;
  const size = Math.max(largest(x), largest(y)), [box, fx, fy, factor, unit] = squareAxes(g, w, h, size, names[0], names[1]);
  clipped(g, box, () => {
    if (byId("orbit-raw").checked) {
      curve(g, x.length, (i) => fx(x[i]), (i) => fy(y[i]), colors.c0, 1.2, FINE);
      const dots = [];
      for (let i = 1; i < x.length; ++i) {
        if (Math.floor(angle[i] / TURN) !== Math.floor(angle[i - 1] / TURN) && !Number.isNaN(angle[i - 1])) dots.push([fx(x[i]), fy(y[i]), 0]);
      }
      g.fillStyle = colors.text;
      marks(g, dots, false);
    }
    if (filtered) {
      const [[a, b], [c, d]] = turn.vectors, at = (k) => TURN * k / 90;
      // x(t) = Re(Z e^(j beta)); the keyphasor mark is at beta = 0.
      curve(g, 91, (k) => fx(a * Math.cos(at(k)) - b * Math.sin(at(k))), (k) => fy(c * Math.cos(at(k)) - d * Math.sin(at(k))), colors.c1, 2);
      g.fillStyle = colors.c1;
      g.beginPath();
      g.arc(fx(a), fy(c), 5, 0, TURN);
      g.fill();
    }
  });
  machine(g, box, names.map((name) => `${name} probe`), Math.sign(angle[angle.length - 1] - angle[0]) || 0);
  label(g, `raw ${digits(size / factor)} ${unit} peak`, box.x + box.w - 6, box.y + box.h - 8, colors.c0);
  if (filtered) {
    const [[a, b], [c, d]] = turn.vectors;
    const forward = Math.hypot(a - d, b + c), backward = Math.hypot(a + d, b - c);
    label(g, `1X ${forward >= backward ? "forward" : "backward"}, keyphasor dot`, box.x + box.w - 6, box.y + box.h - 23, colors.c1);
  }
}

function drawPhase() {
  const [g, w, h] = prepare(byId("phase")), name = store.stream.orbit[0];
  if (!name) return empty(g, w, h, "needs a displacement");
  const { data: [x, estimate, armed], dt } = recent([channelIndex(name), channelIndex(`v${name}_est`), channelIndex("armed")], seconds());
  if (x.length < 3) return empty(g, w, h, "no samples yet");
  const estimated = estimate.length > 0 && estimate.every((v, i) => !Number.isNaN(v) && !(armed[i] < 0.5)); // there is none while disarmed
  const velocity = estimated ? estimate : x.map((_, i) => (i > 0 && i + 1 < x.length ? (x[i + 1] - x[i - 1]) / (2 * dt) : NaN));
  const [sx, ux] = unitFor("displacement", "m", largest(x)), [sv, uv] = unitFor("velocity", "m/s", largest(velocity)), box = plotBox(w, h);
  const lx = 1.1 * (largest(x) || sx) / sx, lv = 1.1 * (largest(velocity) || sv) / sv;
  const [fx, fy] = axes(g, box, { low: -lx, high: lx, label: `${name} [${ux}]` },
    { low: -lv, high: lv, label: `velocity, ${estimated ? "estimated" : "central difference"} [${uv}]` });
  clipped(g, box, () => curve(g, x.length, (i) => fx(x[i] / sx), (i) => fy(velocity[i] / sv), colors.c2, 1.2, FINE));
}

/** Rings and spokes for vectors up to `size`; a lead counts anticlockwise, a lag clockwise. */
function polarAxes(g, w, h, size) {
  const [factor, unit] = unitFor("displacement", "m", size), radius = 0.5 * Math.min(w - 80, h - 52), x = w / 2, y = (h - 14) / 2;
  const top = 1.05 * (size || 1e-6) / factor, scale = radius / top;
  g.strokeStyle = colors.grid;
  g.fillStyle = colors.muted;
  g.lineWidth = 1;
  g.textAlign = "center";
  for (let degrees = 0; degrees < 360; degrees += 30) {
    const at = degrees * Math.PI / 180, c = Math.cos(at), s = Math.sin(at);
    line(g, x, y, x + radius * c, y - radius * s);
    g.fillText(`${lags() ? (360 - degrees) % 360 : degrees}°`, x + (radius + 16) * c, y + 4 - (radius + 11) * s);
  }
  for (const [v, text] of [...ticks(0, top, 3).filter(([r]) => r > 0), [top, ""]]) {
    g.beginPath();
    g.arc(x, y, v * scale, 0, TURN);
    g.stroke();
    g.fillText(text, x + v * scale * Math.cos(1.3), y + 4 - v * scale * Math.sin(1.3));
  }
  g.fillStyle = colors.text;
  g.fillText(`1X, peak [${unit}]`, x, h - 3);
  return [{ x: 0, y: 0, w, h }, (v) => x + v / factor * scale, (v) => y - v / factor * scale];
}

function drawPolar() {
  const [g, w, h] = prepare(byId("polar"));
  if (!store.stream.tracked.length) return empty(g, w, h, "needs the rotor angle: channel beta");
  if (store.turns.length < 2) return empty(g, w, h, "no full turn yet");
  let size = 0;
  for (const t of store.turns) for (const v of t.vectors) size = Math.max(size, Math.hypot(v[0], v[1]));
  const [box, fx, fy] = polarAxes(g, w, h, size);
  clipped(g, box, () => store.stream.tracked.forEach((name, k) => {
    g.fillStyle = g.strokeStyle = seriesColor(k);
    for (const open of [true, false]) {
      marks(g, store.turns.filter((t) => t.open === open).map((t) => [fx(t.vectors[k][0]), fy(t.vectors[k][1]), t.direction]), open);
    }
    label(g, name, box.x + box.w - 6, box.y + 14 + 15 * k, seriesColor(k));
  }));
  machine(g, { x: w / 2 - 0.5 * Math.min(w - 80, h - 52), y: 0, w: Math.min(w - 80, h - 52), h: h - 14 }, ["probe"], 0);
  const [name] = store.stream.tracked;
  let next = 0; // speeds written along the first curve, not closer than 60 pixels
  const at = [];
  for (const t of store.turns) {
    if (next++ % 5) continue;
    const p = [fx(t.vectors[0][0]), fy(t.vectors[0][1])];
    if (at.every((q) => Math.hypot(p[0] - q[0], p[1] - q[1]) > 60) && at.length < 8) {
      at.push(p);
      label(g, `${t.rpm.toFixed(0)}`, p[0] + 5, p[1] - 4, colors.muted, "left");
    }
  }
  byId("polar-state").textContent = `${lags() ? "clockwise" : "anticlockwise"}; numbers: rpm (${name})`;
}

export const orbitPanels = { orbit: drawOrbit, phase: drawPhase, polar: drawPolar };
