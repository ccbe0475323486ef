// Drawing on canvases: colours of the page, axes, curves.
import { ticks } from "./units.js";

export const colors = {};
export function readColors() {
  const css = getComputedStyle(document.documentElement);
  for (const name of ["text", "muted", "line", "grid", "panel", "bad", "c0", "c1", "c2", "c3", "c4", "c5"]) {
    colors[name] = css.getPropertyValue("--" + name).trim();
  }
}
export const seriesColor = (i) => colors["c" + (i % 6)];

/** Context, width and height in CSS pixels of a cleared canvas; sharp on dense screens. */
export function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, w, h);
  g.font = "11px " + getComputedStyle(document.body).fontFamily;
  g.lineJoin = "round";
  g.textAlign = "left";
  return [g, w, h];
}
export const plotBox = (w, h) => ({ x: 62, y: 6, w: w - 76, h: h - 42 });

function logTicks(low, high) {
  const out = [];
  for (let e = Math.ceil(Math.log10(low) - 1e-9); e <= Math.log10(high) + 1e-9; ++e) {
    out.push([10 ** e, Math.abs(e) > 2 ? "1e" + String(e).replace("-", "−") : String(10 ** e)]);
  }
  return out;
}
/** Axes of one plot; returns the maps from data to pixels. x and y: {low, high, label, log, ticks}. */
export function axes(g, box, x, y, showX = true) {
  const place = (a) => (a.log ? (v) => Math.log(v / a.low) / Math.log(a.high / a.low) : (v) => (v - a.low) / (a.high - a.low));
  const px = place(x), py = place(y);
  const fx = (v) => box.x + box.w * px(v), fy = (v) => box.y + box.h * (1 - py(v));
  const marks = (a, most) => a.ticks || (a.log ? logTicks(a.low, a.high) : ticks(a.low, a.high, most));
  g.strokeStyle = colors.grid;
  g.fillStyle = colors.muted;
  g.lineWidth = 1;
  g.textAlign = "right";
  for (const [v, text] of marks(y, Math.max(2, box.h / 34))) {
    line(g, box.x, fy(v), box.x + box.w, fy(v));
    g.fillText(text, box.x - 5, fy(v) + 4);
  }
  g.textAlign = "center";
  for (const [v, text] of marks(x, Math.max(2, box.w / 70))) {
    line(g, fx(v), box.y, fx(v), box.y + box.h);
    if (showX) g.fillText(text, fx(v), box.y + box.h + 14);
  }
  g.strokeStyle = colors.muted;
  g.strokeRect(box.x, box.y, box.w, box.h);
  g.fillStyle = colors.text;
  if (showX && x.label) g.fillText(x.label, box.x + box.w / 2, box.y + box.h + 28);
  g.save();
  g.translate(12, box.y + box.h / 2);
  g.rotate(-Math.PI / 2);
  g.fillText(y.label, 0, 0);
  g.restore();
  return [fx, fy];
}
export function line(g, x0, y0, x1, y1) {
  g.beginPath();
  g.moveTo(x0, y0);
  g.lineTo(x1, y1);
  g.stroke();
}
export function clipped(g, box, draw) {
  g.save();
  g.beginPath();
  g.rect(box.x, box.y, box.w, box.h);
  g.clip();
  draw();
  g.restore();
}
export function dashed(g, draw, pattern = [6, 4]) {
  g.setLineDash(pattern);
  draw();
  g.setLineDash([]);
}
/** A curve through n points; NaN lifts the pen. Points nearer than `step` pixels to the last one drawn are left out. */
export function curve(g, n, x, y, color, width = 1.2, step = 0) {
  g.strokeStyle = color;
  g.lineWidth = width;
  g.beginPath();
  let pen = false, lastX = 0, lastY = 0;
  for (let i = 0; i < n; ++i) {
    const a = x(i), b = y(i), ok = !Number.isNaN(a) && !Number.isNaN(b);
    if (ok && pen && Math.abs(a - lastX) + Math.abs(b - lastY) < step) continue;
    if (ok && pen) g.lineTo(a, b);
    if (ok && !pen) g.moveTo(a, b);
    pen = ok;
    lastX = a;
    lastY = b;
  }
  g.stroke();
}
/** Points [x, y, shape] whose shape says more than their colour: 1 up, -1 down, 0 dot; hollow or filled. Of points on one
    pixel one is drawn, all in one path: thousands of turns cost as much as they show. */
export function marks(g, points, hollow) {
  const r = 2.6, taken = new Set();
  g.beginPath();
  for (const [x, y, shape] of points) {
    const pixel = (Math.round(x) * 4096 + Math.round(y)) * 3 + shape;
    if (taken.has(pixel)) continue;
    taken.add(pixel);
    if (shape === 0) {
      g.moveTo(x + 1.8, y);
      g.arc(x, y, 1.8, 0, 2 * Math.PI);
    } else {
      g.moveTo(x - r, y + shape * r * 0.8);
      g.lineTo(x + r, y + shape * r * 0.8);
      g.lineTo(x, y - shape * r);
      g.closePath();
    }
  }
  if (hollow) g.stroke(); else g.fill();
}
/** Text on the colour of the panel, so that it can be read over curves. */
export function label(g, text, x, y, color, align = "right") {
  const width = g.measureText(text).width;
  g.fillStyle = colors.panel;
  g.globalAlpha = 0.8;
  g.fillRect(align === "right" ? x - width - 3 : x - 3, y - 10, width + 6, 14);
  g.globalAlpha = 1;
  g.fillStyle = color;
  g.textAlign = align;
  g.fillText(text, x, y);
}
/** The machine at the rim of a plot of the shaft's plane: where the probes x and y stand, and the way the shaft turns (1 from x towards y,
    -1 the other way, 0 not known). */
export function machine(g, { x, y, w, h }, probes, sense) {
  g.fillStyle = g.strokeStyle = colors.text;
  for (const [k, name] of probes.entries()) {
    const px = k === 0 ? x + w : x + w / 2, py = k === 0 ? y + h / 2 : y, [ax, ay] = k === 0 ? [-8, 0] : [0, 8];
    g.beginPath();
    g.moveTo(px + ax, py + ay);
    g.lineTo(px - 0.5 * ay, py + 0.5 * ax);
    g.lineTo(px + 0.5 * ay, py - 0.5 * ax);
    g.fill();
    g.textAlign = k === 0 ? "right" : "left";
    g.fillText(name, k === 0 ? px - 2 : px + 8, k === 0 ? py - 8 : py + 12);
  }
  if (!sense) return;
  const cx = x + 20, cy = y + 20, r = 10, from = 0.2 * Math.PI, to = -1.3 * Math.PI, end = sense > 0 ? to : Math.PI - to;
  g.lineWidth = 1.4;
  g.beginPath();
  g.arc(cx, cy, r, sense > 0 ? from : Math.PI - from, end, sense > 0);
  g.stroke();
  const at = (angle, d) => [cx + d * Math.cos(angle), cy + d * Math.sin(angle)];
  g.beginPath();
  g.moveTo(...at(end - 0.5 * sense, r));
  g.lineTo(...at(end, r - 4));
  g.lineTo(...at(end, r + 4));
  g.fill();
  g.textAlign = "left";
  g.fillText("rotation", cx + 16, cy + 4);
}
export function empty(g, w, h, text) {
  g.fillStyle = colors.muted;
  g.textAlign = "center";
  g.fillText(text, w / 2, h / 2);
}

const RAMP = [[68, 1, 84], [65, 68, 135], [42, 120, 142], [34, 168, 132], [122, 209, 81], [253, 231, 37]];
/** Colour of a fraction 0 to 1: dark to light also without colour vision. */
export function rampColor(f) {
  const at = Math.min(Math.max(f, 0), 1) * (RAMP.length - 1), k = Math.min(RAMP.length - 2, Math.floor(at));
  return RAMP[k].map((c, i) => c + (at - k) * (RAMP[k + 1][i] - c));
}
