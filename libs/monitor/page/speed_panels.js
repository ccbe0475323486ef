// Synchronous motion over rotor speed: Bode plot, and the run against the open loop.
import { store } from "./store.js";
import { unitFor, digits, RPM, lags } from "./units.js";
import { prepare, plotBox, axes, clipped, curve, marks, label, empty, colors, seriesColor } from "./canvas.js";

const byId = (id) => document.getElementById(id);
const BANDS = 8;

/** Range of speed of turns and reference, and the largest 1X amplitude. */
function extent(reference) {
  let low = Infinity, high = -Infinity, size = 0;
  for (const t of store.turns) {
    low = Math.min(low, t.rpm);
    high = Math.max(high, t.rpm);
    for (const v of t.vectors) size = Math.max(size, Math.hypot(v[0], v[1]));
  }
  if (reference) {
    for (const v of reference.rpm) { low = Math.min(low, v); high = Math.max(high, v); }
    size = Math.max(size, ...reference.amplitude);
  }
  if (high - low < 1) { low -= 5; high += 5; }
  return { low, high, size };
}
/** Reference run of the first tracked channel. */
function referenceOf() {
  const r = store.stream.reference;
  if (!r) return null;
  return { name: r.name, rpm: r.speed.map((v) => Math.abs(v) / RPM), amplitude: r.amplitude[store.stream.tracked[0]] || Object.values(r.amplitude)[0] };
}

function drawBode() {
  const [g, w, h] = prepare(byId("bode"));
  if (!store.stream.tracked.length) return empty(g, w, h, "needs the rotor angle: channel beta");
  if (store.turns.length < 2) return empty(g, w, h, "no full turn yet");
  const { low, high, size } = extent(null), [factor, unit] = unitFor("displacement", "m", size);
  const upper = { x: 62, y: 6, w: w - 76, h: 0.6 * (h - 50) }, lower = { x: 62, y: upper.y + upper.h + 8, w: w - 76, h: 0.4 * (h - 50) };
  const [fx, fa] = axes(g, upper, { low, high }, { low: 0, high: 1.1 * size / factor || 1, label: `1X [${unit}]` }, false);
  const [, fp] = axes(g, lower, { low, high, label: "rotor speed [rpm]" },
    { low: -180, high: 180, label: `phase ${lags() ? "lag" : "lead"} [°]`, ticks: [-180, -90, 0, 90, 180].map((v) => [v, String(v).replace("-", "−")]) });
  store.stream.tracked.forEach((name, k) => {
    g.fillStyle = g.strokeStyle = seriesColor(k);
    let peak = store.turns[0];
    const points = [[], []]; // armed, disarmed
    for (const t of store.turns) {
      const [re, im] = t.vectors[k], amplitude = Math.hypot(re, im);
      if (amplitude > Math.hypot(...peak.vectors[k])) peak = t;
      points[Number(t.open)].push([fx(t.rpm), fa(amplitude / factor), t.direction],
        [fx(t.rpm), fp((lags() ? -1 : 1) * Math.atan2(im, re) * 180 / Math.PI), t.direction]);
    }
    marks(g, points[0], false);
    marks(g, points[1], true);
    label(g, `${name}: ${digits(Math.hypot(...peak.vectors[k]) / factor)} ${unit} peak at ${peak.rpm.toFixed(0)} rpm`,
      upper.x + upper.w - 6, upper.y + 14 + 15 * k, seriesColor(k));
  });
}

function drawCompare() {
  const [g, w, h] = prepare(byId("compare")), reference = referenceOf();
  if (!store.stream.tracked.length) return empty(g, w, h, "needs the rotor angle: channel beta");
  const open = store.turns.filter((t) => t.open), closed = store.turns.filter((t) => !t.open);
  if (!reference && (!open.length || !closed.length)) return empty(g, w, h, "needs a reference record, or turns armed and disarmed");
  const { low, high, size } = extent(reference), [factor, unit] = unitFor("displacement", "m", size), box = plotBox(w, h);
  const amplitude = (t) => Math.hypot(...t.vectors[0]);
  const [fx, fy] = axes(g, box, { low, high, label: "rotor speed [rpm]" },
    { low: 0, high: 1.25 * size / factor || 1, label: `1X of ${store.stream.tracked[0]} [${unit}]` });
  const most = { open: new Array(BANDS).fill(0), closed: new Array(BANDS).fill(0) };
  const at = (t) => [fx(t.rpm), fy(amplitude(t) / factor), t.direction];
  const bandOf = (rpm) => Math.min(BANDS - 1, Math.max(0, Math.floor((rpm - low) / (high - low) * BANDS)));
  const take = (to, rpm, a) => { to[bandOf(rpm)] = Math.max(to[bandOf(rpm)], a); };
  if (reference) reference.rpm.forEach((v, i) => take(most.open, v, reference.amplitude[i]));
  for (const t of open) take(most.open, t.rpm, amplitude(t));
  for (const t of closed) take(most.closed, t.rpm, amplitude(t));
  clipped(g, box, () => {
    if (reference) curve(g, reference.rpm.length, (i) => fx(reference.rpm[i]), (i) => fy(reference.amplitude[i] / factor), colors.muted, 1.5);
    g.strokeStyle = g.fillStyle = colors.c1;
    marks(g, open.map(at), true);
    g.strokeStyle = g.fillStyle = colors.c0;
    marks(g, closed.map(at), false);
  });
  g.textAlign = "center";
  g.fillStyle = colors.text;
  for (let b = 0; b < BANDS; ++b) {
    if (!(most.open[b] > 0 && most.closed[b] > 0)) continue;
    const percent = 100 * (1 - most.closed[b] / most.open[b]);
    g.fillText(`${percent.toFixed(1).replace("-", "−")} %`, box.x + box.w * (b + 0.5) / BANDS, box.y + 30);
  }
  label(g, "suppression per speed band, 1X peak", box.x + box.w - 6, box.y + 14, colors.text);
  byId("compare-state").textContent = `${reference ? `grey: ${reference.name.split("/").pop()}; ` : ""}filled: armed, hollow: disarmed; ▲ run-up, ▼ run-down`;
}

export const speedPanels = { bode: drawBode, compare: drawCompare };
