// Frequency domain: averaged spectrum, full spectrum of the orbit, waterfall.
import { store, channelIndex, speedAt, WATERFALL_ROWS } from "./store.js";
import { unitFor, digits, largest } from "./units.js";
import { prepare, plotBox, axes, clipped, curve, dashed, line, label, empty, colors, seriesColor, rampColor } from "./canvas.js";

const byId = (id) => document.getElementById(id);
const spacing = () => store.stream.spectrum.spacing_hz;
/** Lines of a spectrum up to the chosen part of its range. */
const shownLines = (n) => Math.max(8, Math.min(n, Math.ceil(n * Number(byId("range").value))));
/** Line and height of a peak between lines: vertex of the parabola through three logarithms. A line of the Hann window reads a
    sine between two lines up to 15 % low. */
function between(data, k) {
  const [a, b, c] = [k - 1, k, k + 1].map((i) => Math.log(Math.max(data[i], 1e-30))), bend = a - 2 * b + c;
  return bend < 0 ? [k + 0.5 * (a - c) / bend, Math.exp(b - (a - c) ** 2 / (8 * bend))] : [k, data[k]];
}
const runningHz = () => (store.turns.length ? store.turns[store.turns.length - 1].rpm / 60 : 0);

function spectrumChannels() {
  const orbit = store.stream.orbit.map(channelIndex);
  if (orbit.length) return orbit;
  return store.stream.channels.map((c, i) => [c, i]).filter(([c]) => c.quantity !== "angle").map(([, i]) => i).slice(0, 2);
}
/** Vertical lines at multiples of the running speed. */
function orderLines(g, box, fx, orders) {
  const f = runningHz();
  if (!(f > 0)) return;
  g.strokeStyle = g.fillStyle = colors.muted;
  g.textAlign = "left";
  let written = -Infinity;
  for (const k of orders) {
    const at = fx(k * f);
    if (at < box.x || at > box.x + box.w) continue;
    dashed(g, () => line(g, at, box.y, at, box.y + box.h), [2, 4]);
    if (at - written < 24) continue; // no room
    written = at;
    g.fillText(`${String(k).replace("-", "−")}X`, at + 3, box.y + box.h - 5);
  }
}
function drawLines(g, box, fx, fy, from, to, amplitude, floor, color) {
  clipped(g, box, () => curve(g, to - from, (i) => fx(from + i), (i) => fy(Math.max(amplitude(from + i), floor)), color));
}

function drawSpectrum() {
  const [g, w, h] = prepare(byId("spectrum"));
  if (!store.spectrum) return empty(g, w, h, "no block complete yet");
  const chosen = spectrumChannels(), { data, n } = store.spectrum, first = store.stream.channels[chosen[0]];
  let size = 0;
  for (const i of chosen) size = Math.max(size, largest(data[i].subarray(1)));
  const [factor, unit] = unitFor(first.quantity, first.unit, size);
  const top = 10 ** Math.ceil(Math.log10((size || 1) / factor)), box = plotBox(w, h), lines = shownLines(n), df = spacing();
  const [fx, fy] = axes(g, box, { low: 0, high: df * (lines - 1), label: "frequency [Hz]" },
    { low: top * 1e-5, high: top, label: `amplitude, peak [${unit}]`, log: true });
  orderLines(g, box, fx, [1, 2, 3]);
  const readings = [];
  chosen.forEach((i, k) => {
    drawLines(g, box, (bin) => fx(bin * df), fy, 1, lines, (bin) => data[i][bin] / factor, top * 1e-7, seriesColor(k));
    let peak = 2;
    for (let bin = 2; bin < lines - 1; ++bin) if (data[i][bin] > data[i][peak]) peak = bin;
    const [at, height] = between(data[i], peak);
    readings.push(`${store.stream.channels[i].name}: ${digits(height / factor)} ${unit} peak at ${(at * df).toFixed(2)} Hz`);
    label(g, readings[k], box.x + box.w - 6, box.y + 14 + 15 * k, seriesColor(k));
  });
  byId("spectrum-peak").textContent = readings.join("; ");
}

function drawFull() {
  const [g, w, h] = prepare(byId("full"));
  if (store.stream.orbit.length !== 2) return empty(g, w, h, "needs the displacements x and y");
  if (!store.full) return empty(g, w, h, "no block complete yet");
  const { data, n } = store.full, middle = (n - 1) / 2, lines = Math.min(middle, shownLines(middle + 1) - 1), df = spacing();
  let size = 0, peak = middle + 2;
  for (let i = middle - lines; i <= middle + lines; ++i) {
    if (Math.abs(i - middle) > 1 && data[i] > size) { size = data[i]; peak = i; }
  }
  const [factor, unit] = unitFor("displacement", "m", size), top = 10 ** Math.ceil(Math.log10((size || 1) / factor)), box = plotBox(w, h);
  const [fx, fy] = axes(g, box, { low: -df * lines, high: df * lines, label: "backward whirl ← frequency [Hz] → forward whirl" },
    { low: top * 1e-5, high: top, label: `amplitude, peak [${unit}]`, log: true });
  orderLines(g, box, fx, [-2, -1, 1, 2]);
  drawLines(g, box, (i) => fx((i - middle) * df), fy, middle - lines, middle + lines + 1, (i) => data[i] / factor, top * 1e-7, colors.c3);
  const [at, height] = between(data, peak);
  label(g, `${digits(height / factor)} ${unit} peak, ${peak > middle ? "forward" : "backward"}, ${digits(Math.abs(at - middle) * df, 4)} Hz`,
    box.x + box.w - 6, box.y + 14, colors.c3);
}

const FEWEST_ROWS = 40;
let image = null, scale = 0; // rows of the waterfall as pixels, and the amplitude of the lightest colour
function addRow(row) {
  if (!image || image.width !== row.n || store.waterfall.length === 1) {
    image = document.createElement("canvas");
    image.width = row.n;
    image.height = WATERFALL_ROWS;
    scale = 0;
  }
  scale = Math.max(scale * 0.999, largest(row.data.subarray(2)));
  const g = image.getContext("2d", { willReadFrequently: true }), pixels = g.createImageData(row.n, 1);
  g.drawImage(image, 0, 1);
  for (let i = 0; i < row.n; ++i) {
    const [r, gr, b] = rampColor(1 + 20 * Math.log10((row.data[i] || 1e-30) / (scale || 1)) / 60);
    pixels.data.set([r, gr, b, 255], 4 * i);
  }
  g.putImageData(pixels, 0, 0);
  row.drawn = true;
  row.rpm = speedAt(row.t);
}
function drawWaterfall() {
  const [g, w, h] = prepare(byId("waterfall")), rows = store.waterfall;
  if (!rows.length) return empty(g, w, h, "no block complete yet");
  for (let i = rows.length - 1; i >= 0; --i) if (!rows[i].drawn) addRow(rows[i]);
  const box = plotBox(w, h), shown = shownLines(image.width), df = spacing(), newest = rows[0].t, oldest = rows[rows.length - 1].t;
  const perRow = rows.length > 1 ? (newest - oldest) / (rows.length - 1) : 1, high = df * (shown - 1), shownRows = Math.max(FEWEST_ROWS, rows.length);
  const [fx, fy] = axes(g, box, { low: 0, high, label: "frequency [Hz]" }, { low: -shownRows * perRow, high: 0, label: "time before now [s]" });
  g.imageSmoothingEnabled = false;
  g.drawImage(image, 0, 0, shown, shownRows, box.x, box.y, box.w, box.h);
  clipped(g, box, () => [1, 2].forEach((order) => dashed(g, () =>
    curve(g, rows.length, (i) => (rows[i].rpm > 0 ? fx(order * rows[i].rpm / 60) : NaN), (i) => fy(-(i + 0.5) * perRow), "#ffffff"), [3, 5])));
  const index = spectrumChannels()[0], channel = store.stream.channels[index], [factor, unit] = unitFor(channel.quantity, channel.unit, scale);
  byId("waterfall-state").textContent = `${channel.name}, single blocks, 60 dB below ${digits(scale / factor)} ${unit} peak; white: 1X, 2X`;
}

export const spectrumPanels = { spectrum: drawSpectrum, full: drawFull, waterfall: drawWaterfall };
