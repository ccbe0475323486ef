// The run that is shown and another recording, one on the other: 1X amplitude, phase, and how far their vectors are apart.
import { store, directionAt } from "./store.js";
import { unitFor, digits, withUnit, RPM, lags } from "./units.js";
import { prepare, axes, clipped, curve, marks, label, empty, colors } from "./canvas.js";
import { alignment, atTime, bySpeed } from "./align.js";

const byId = (id) => document.getElementById(id);
const DEGREE = 180 / Math.PI;

/** Turns of both runs for one channel: {t, rpm, direction, re, im}. */
function turnsOf(name, k) {
  const r = store.stream.reference, other = r.amplitude[name] ? name : Object.keys(r.amplitude)[0];
  const shown = store.turns.map((t) => ({ t: t.t, rpm: t.rpm, direction: t.direction, re: t.vectors[k][0], im: t.vectors[k][1] }));
  const second = r.speed.map((v, i) => ({ t: r.time[i], rpm: Math.abs(v) / RPM, re: r.amplitude[other][i] * Math.cos(r.phase[other][i]),
    im: r.amplitude[other][i] * Math.sin(r.phase[other][i]) }));
  second.forEach((t, i) => { t.direction = directionAt(second, i); });
  return [shown, second, other];
}
/** Turns since time last ran backwards or leapt: another pass, a seek. */
function lastPass(turns) {
  for (let i = turns.length - 1; i > 0; --i) {
    const turn = 60 / Math.max(1, Math.min(turns[i].rpm, turns[i - 1].rpm)), gap = turns[i].t - turns[i - 1].t;
    if (gap <= 0 || gap > Math.max(4 * turn, 1)) return turns.slice(i);
  }
  return turns;
}

let kept = { key: "", found: null }; // the alignment is worked out anew when a twentieth of the turns is new
function aligned(shown, second) {
  const key = `${store.stream.opened}/${store.stream.reference.name}/${second.length}/${shown.length && shown[0].t}/${Math.floor(Math.log(shown.length + 1) * 20)}`;
  if (key !== kept.key) kept = { key, found: alignment(shown, second) };
  return kept.found;
}

function drawRow(g, box, x, y, showX, points) {
  const [fx, fy] = axes(g, box, x, y, showX);
  clipped(g, box, () => points.forEach(([list, color, line]) => {
    g.fillStyle = g.strokeStyle = color;
    if (line) curve(g, list.length, (i) => fx(list[i][0]), (i) => fy(list[i][1]), color, 1.6, 1);
    else marks(g, list.map(([u, v, d]) => [fx(u), fy(v), d]), false);
  }));
}

function drawRuns() {
  const [g, w, h] = prepare(byId("runs")), r = store.stream.reference;
  if (!r || !r.time.length) return empty(g, w, h, "drop a second recording here, or open one above");
  if (store.turns.length < 4) return empty(g, w, h, "no full turns yet");
  const name = store.stream.tracked[0], [all, second, other] = turnsOf(name, 0), overTime = byId("runs-over").value === "time";
  const shown = overTime ? lastPass(all) : all, found = overTime ? aligned(shown, second) : null;
  if (overTime && !found) return empty(g, w, h, "no common change of speed to align the runs by; compare them over speed");
  const place = overTime ? (t) => t.t : (t) => t.rpm, moved = overTime ? (t) => t.t + found.shift : (t) => t.rpm;
  const match = overTime ? (t) => atTime(second, t.t, found.shift) : ((f) => (t) => f(t.rpm, t.direction))(bySpeed(second));
  const amplitude = (t) => Math.hypot(t.re, t.im), phase = (t) => (lags() ? -1 : 1) * Math.atan2(t.im, t.re) * DEGREE;
  let low = Infinity, high = -Infinity, size = 0, worst = null;
  for (const [run, where] of [[shown, place], [second, moved]]) {
    for (const t of run) { low = Math.min(low, where(t)); high = Math.max(high, where(t)); size = Math.max(size, amplitude(t)); }
  }
  if (high - low < 1e-3) { low -= 5; high += 5; }
  const apart = [];
  for (const t of shown) {
    const v = match(t);
    if (!v) continue;
    const d = Math.hypot(t.re - v[0], t.im - v[1]);
    apart.push([place(t), d, 0]);
    if (!worst || d > worst.d) worst = { d, rpm: t.rpm };
  }
  const [factor, unit] = unitFor("displacement", "m", size), each = (h - 54) / (overTime ? 4 : 3);
  const x = { low, high, label: overTime ? "time of the run shown [s]" : "rotor speed [rpm]" };
  const rows = [
    ...(overTime ? [[{ low: 0, high: 1.1 * Math.max(...shown.map((t) => t.rpm), ...second.map((t) => t.rpm)), label: "speed [rpm]" }, (t) => t.rpm]] : []),
    [{ low: 0, high: 1.1 * size / factor || 1, label: `1X [${unit}]` }, (t) => amplitude(t) / factor],
    [{ low: -180, high: 180, label: `${lags() ? "lag" : "lead"} [°]`, ticks: [-180, -90, 0, 90, 180].map((v) => [v, String(v).replace("-", "−")]) }, phase],
  ];
  const boxOf = (k) => ({ x: 62, y: 6 + k * (each + 6), w: w - 76, h: each });
  rows.forEach(([y, value], k) => {
    const list = (run, where) => run.map((t) => [where(t), value(t), t.direction]);
    drawRow(g, boxOf(k), x, y, false, [[list(second, moved), colors.c1, false], [list(shown, place), colors.c0, false]]);
  });
  const last = boxOf(rows.length), far = Math.max(...apart.map(([, d]) => d), 0);
  drawRow(g, last, x, { low: 0, high: 1.2 * far / factor || 1, label: `apart [${unit}]` }, true, [[apart.map(([u, d]) => [u, d / factor, 0]), colors.text, false]]);
  const first = boxOf(0);
  label(g, `shown: ${store.stream.name.split("/").pop()}, ${name}`, first.x + first.w - 6, first.y + 14, colors.c0);
  label(g, `compared: ${r.name.split("/").pop()}, ${other}`, first.x + first.w - 6, first.y + 29, colors.c1);
  const shift = overTime ? `compared run moved by ${digits(found.shift, 4)} s` : "";
  const most = worst ? `1X vectors at most ${withUnit(worst.d, "displacement", "m")} peak apart, at ${worst.rpm.toFixed(0)} rpm` : "no speed in common yet";
  byId("runs-state").textContent = [shift, most].filter(Boolean).join("; ");
}

export const runsPanels = { runs: drawRuns };
