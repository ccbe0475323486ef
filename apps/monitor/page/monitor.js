"use strict";
// Live view of a stream of frames (libraries: none). Frame format: apps/monitor/include/whirl/monitor/frame.hpp.

const byId = (id) => document.getElementById(id);
const token = new URLSearchParams(location.hash.slice(1)).get("token");
const KIND = { samples: 1, minMax: 2, decimated: 3, spectrum: 4, synchronous: 5 };
const RECENT = 0.5; // s of orbit and phase plane

let stream = null;          // description of the stream
let chunks = [];            // time: {t, dt, n, pairs, data: Float32Array per channel}
let recent = [];            // raw or decimated samples for orbit and phase plane
let spectrum = null, waterfall = null;
let turns = [];             // {rpm, vectors}
let lastTime = 0, lastArrival = 0, lastSeq = null, missed = 0, dropped = 0;
let connected = false, sourceState = "";
let socket = null;

// ---- units -------------------------------------------------------------------------------------------------------
const PREFIXES = {
  displacement: [[1, "m"], [1e-3, "mm"], [1e-6, "µm"]], velocity: [[1, "m/s"], [1e-3, "mm/s"]],
  force: [[1, "N"], [1e-3, "mN"]], voltage: [[1, "V"], [1e-3, "mV"]], acceleration: [[1, "m/s²"]],
};
function unitFor(quantity, si, size) {
  const list = PREFIXES[quantity];
  if (!list) return [1, si === "1" ? "" : si];
  const from = quantity === "displacement" ? 0.1 : 1; // 0.5 mm reads better than 500 µm
  return list.find(([factor]) => size >= factor * from) || list[list.length - 1];
}
function digits(value, n = 3) {
  return Number.isFinite(value) ? Number(value.toPrecision(n)).toString().replace("-", "−") : "–";
}
function ticks(low, high, most) {
  const raw = (high - low) / Math.max(1, most), power = 10 ** Math.floor(Math.log10(raw));
  let step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw * 0.999999);
  if (Math.floor(high / step) === Math.ceil(low / step)) step /= 2; // one tick alone is no scale
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) out.push(k * step);
  const mantissa = step / 10 ** Math.floor(Math.log10(step) + 1e-9);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (Math.abs(mantissa - 2.5) < 1e-6 ? 1 : 0));
  return out.map((v) => [v, v.toFixed(decimals).replace("-", "−")]);
}

// ---- drawing -----------------------------------------------------------------------------------------------------
let colors = {};
function readColors() {
  const css = getComputedStyle(document.documentElement);
  for (const name of ["text", "muted", "line", "grid", "panel", "c0", "c1", "c2", "c3", "c4", "c5"]) {
    colors[name] = css.getPropertyValue("--" + name).trim();
  }
}
const seriesColor = (i) => colors["c" + (i % 6)];

function prepare(canvas) {
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
  return [g, w, h];
}
/** Axes of one plot; returns the maps from data to pixels. x and y: {low, high, label, log}. */
function axes(g, box, x, y, xTicks = true) {
  const fx = (v) => box.x + box.w * (v - x.low) / (x.high - x.low);
  const position = y.log ? (v) => Math.log(v / y.low) / Math.log(y.high / y.low) : (v) => (v - y.low) / (y.high - y.low);
  const fy = (v) => box.y + box.h * (1 - position(v));
  g.strokeStyle = colors.grid;
  g.fillStyle = colors.muted;
  g.lineWidth = 1;
  g.textAlign = "right";
  let yTicks;
  if (y.log) {
    yTicks = [];
    for (let e = Math.ceil(Math.log10(y.low)); e <= Math.log10(y.high); ++e) yTicks.push([10 ** e, Math.abs(e) > 2 ? "1e" + e : String(10 ** e)]);
  } else {
    yTicks = y.ticks || ticks(y.low, y.high, Math.max(3, box.h / 34));
  }
  for (const [v, text] of yTicks) {
    g.beginPath(); g.moveTo(box.x, fy(v)); g.lineTo(box.x + box.w, fy(v)); g.stroke();
    g.fillText(text, box.x - 5, fy(v) + 4);
  }
  g.textAlign = "center";
  for (const [v, text] of ticks(x.low, x.high, Math.max(2, box.w / 70))) {
    g.beginPath(); g.moveTo(fx(v), box.y); g.lineTo(fx(v), box.y + box.h); g.stroke();
    if (xTicks) g.fillText(text, fx(v), box.y + box.h + 14);
  }
  g.strokeStyle = colors.muted;
  g.strokeRect(box.x, box.y, box.w, box.h);
  g.fillStyle = colors.text;
  if (xTicks && x.label) g.fillText(x.label, box.x + box.w / 2, box.y + box.h + 28);
  g.save();
  g.translate(12, box.y + box.h / 2);
  g.rotate(-Math.PI / 2);
  g.fillText(y.label, 0, 0);
  g.restore();
  return [fx, fy];
}
function clipped(g, box, draw) {
  g.save();
  g.beginPath();
  g.rect(box.x, box.y, box.w, box.h);
  g.clip();
  draw();
  g.restore();
}
function empty(g, w, h, text) {
  g.fillStyle = colors.muted;
  g.textAlign = "center";
  g.fillText(text, w / 2, h / 2);
}

// ---- plots -------------------------------------------------------------------------------------------------------
const shownChannels = () => stream.channels.map((c, i) => [c, i]).filter(([c]) => c.quantity !== "angle");

function drawTime() {
  const [g, w, h] = prepare(byId("time"));
  const shown = shownChannels();
  if (!chunks.length || !shown.length) return empty(g, w, h, "no samples yet");
  const span = Number(byId("window").value), high = lastTime, low = high - span;
  const each = (h - 34) / shown.length;
  shown.forEach(([channel, index], row) => {
    const box = { x: 62, y: 4 + row * each, w: w - 76, h: each - 8 };
    const columns = Math.max(1, Math.floor(box.w));
    const lows = new Float64Array(columns).fill(NaN), highs = new Float64Array(columns).fill(NaN);
    let size = 0;
    for (const c of chunks) {
      if (c.t + c.n * c.dt < low) continue;
      const data = c.data[index];
      for (let i = 0; i < data.length; ++i) {
        const t = c.t + (c.pairs ? i >> 1 : i) * c.dt, column = Math.floor((t - low) / span * columns), v = data[i];
        if (column < 0 || column >= columns || Number.isNaN(v)) continue;
        if (!(lows[column] <= v)) lows[column] = v;
        if (!(highs[column] >= v)) highs[column] = v;
        if (Math.abs(v) > size) size = Math.abs(v);
      }
    }
    const [factor, unit] = unitFor(channel.quantity, channel.unit, size);
    const limit = size > 0 ? 1.1 * size / factor : 1;
    const [fx, fy] = axes(g, box, { low, high, label: "time [s]" }, { low: -limit, high: limit, label: `${channel.name} [${unit}]` },
      row === shown.length - 1);
    clipped(g, box, () => {
      if (channel.limit) {
        g.strokeStyle = colors.text;
        g.setLineDash([6, 4]);
        for (const v of [channel.limit, -channel.limit]) {
          g.beginPath(); g.moveTo(box.x, fy(v / factor)); g.lineTo(box.x + box.w, fy(v / factor)); g.stroke();
        }
        g.setLineDash([]);
      }
      g.strokeStyle = seriesColor(row);
      g.lineWidth = 1.2;
      g.beginPath();
      let pen = false;
      for (let k = 0; k < columns; ++k) {
        if (Number.isNaN(lows[k])) {
          // Fewer samples than pixels: connect; a real gap is longer than three sample times.
          if (pen && span / columns > 3 * chunks[chunks.length - 1].dt) pen = false;
          continue;
        }
        const px = box.x + k + 0.5, a = fy(highs[k] / factor), b = fy(lows[k] / factor);
        if (pen) g.lineTo(px, a); else g.moveTo(px, a);
        g.lineTo(px, b);
        pen = true;
      }
      g.stroke();
    });
    const over = channel.limit && size > channel.limit ? "above limit: " : "";
    const reading = `${over}${digits(size / factor)} ${unit} peak in window`, width = g.measureText(reading).width;
    g.fillStyle = colors.panel;
    g.fillRect(box.x + box.w - width - 10, box.y + 1, width + 9, 16);
    g.fillStyle = colors.text;
    g.textAlign = "right";
    g.fillText(reading, box.x + box.w - 6, box.y + 13);
  });
}

/** Recent samples of the first two displacement channels, joined. */
function recentPath() {
  const indices = stream.channels.map((c, i) => [c, i]).filter(([c]) => c.quantity === "displacement").map(([, i]) => i);
  const out = { x: [], y: [], dt: 0, channels: indices.slice(0, 2).map((i) => stream.channels[i]) };
  if (!indices.length) return out;
  for (const c of recent) {
    out.dt = c.dt;
    for (let i = 0; i < c.n; ++i) {
      if (c.t + i * c.dt < lastTime - RECENT) continue;
      out.x.push(c.data[indices[0]][i]);
      if (indices.length > 1) out.y.push(c.data[indices[1]][i]);
    }
  }
  return out;
}
function largest(values) {
  let size = 0;
  for (const v of values) if (Math.abs(v) > size) size = Math.abs(v);
  return size;
}
function drawCurve(canvas, xs, ys, xAxis, yAxis, equal, color) {
  const [g, w, h] = prepare(canvas);
  if (xs.length < 3) return empty(g, w, h, "no samples yet");
  const box = { x: 62, y: 6, w: w - 76, h: h - 42 };
  let limitX = 1.1 * (largest(xs) || 1) / xAxis.factor, limitY = 1.1 * (largest(ys) || 1) / yAxis.factor;
  if (equal) {
    const perPixel = Math.max(limitX / box.w, limitY / box.h);
    limitX = perPixel * box.w;
    limitY = perPixel * box.h;
  }
  const [fx, fy] = axes(g, box, { low: -limitX, high: limitX, label: xAxis.label }, { low: -limitY, high: limitY, label: yAxis.label });
  clipped(g, box, () => {
    g.strokeStyle = color;
    g.lineWidth = 1.2;
    g.beginPath();
    let pen = false;
    for (let i = 0; i < xs.length; ++i) {
      const ok = !Number.isNaN(xs[i]) && !Number.isNaN(ys[i]);
      if (ok && pen) g.lineTo(fx(xs[i] / xAxis.factor), fy(ys[i] / yAxis.factor));
      if (ok && !pen) g.moveTo(fx(xs[i] / xAxis.factor), fy(ys[i] / yAxis.factor));
      pen = ok;
    }
    g.stroke();
  });
}
function drawOrbit() {
  const p = recentPath();
  if (p.channels.length < 2) {
    const [g, w, h] = prepare(byId("orbit"));
    return empty(g, w, h, "needs two displacement channels");
  }
  const [factor, unit] = unitFor("displacement", "m", Math.max(largest(p.x), largest(p.y)));
  drawCurve(byId("orbit"), p.x, p.y, { factor, label: `${p.channels[0].name} [${unit}]` }, { factor, label: `${p.channels[1].name} [${unit}]` },
    true, colors.c0);
}
function drawPhase() {
  const p = recentPath();
  if (!p.channels.length) {
    const [g, w, h] = prepare(byId("phase"));
    return empty(g, w, h, "needs a displacement channel");
  }
  const velocity = p.x.map((_, i) => (i > 0 && i + 1 < p.x.length ? (p.x[i + 1] - p.x[i - 1]) / (2 * p.dt) : NaN));
  const [fx, ux] = unitFor("displacement", "m", largest(p.x)), [fv, uv] = unitFor("velocity", "m/s", largest(velocity));
  drawCurve(byId("phase"), p.x, velocity, { factor: fx, label: `${p.channels[0].name} [${ux}]` },
    { factor: fv, label: `velocity, central difference [${uv}]` }, false, colors.c2);
}

function spectrumChannels() {
  const displacement = shownChannels().filter(([c]) => c.quantity === "displacement");
  return displacement.length ? displacement : shownChannels().slice(0, 2);
}
/** Lines of a spectrum up to the chosen part of its range. */
function shownLines(n) {
  return Math.max(8, Math.min(n, Math.ceil(n * Number(byId("range").value))));
}
function drawSpectrum() {
  const [g, w, h] = prepare(byId("spectrum"));
  if (!spectrum) return empty(g, w, h, "no block complete yet");
  const chosen = spectrumChannels();
  let size = 0;
  for (const [, i] of chosen) size = Math.max(size, largest(spectrum.data[i].subarray(1)));
  const [factor, unit] = unitFor(chosen[0][0].quantity, chosen[0][0].unit, size);
  const top = 10 ** Math.ceil(Math.log10((size || 1) / factor)), spacing = stream.spectrum.spacing_hz;
  const box = { x: 62, y: 6, w: w - 76, h: h - 42 }, lines = shownLines(spectrum.n);
  const [fx, fy] = axes(g, box, { low: 0, high: spacing * (lines - 1), label: "frequency [Hz]" },
    { low: top * 1e-5, high: top, label: `amplitude, peak [${unit}]`, log: true });
  clipped(g, box, () => chosen.forEach(([, i], k) => {
    g.strokeStyle = seriesColor(k);
    g.lineWidth = 1.2;
    g.beginPath();
    for (let line = 1; line < lines; ++line) {
      const px = fx(line * spacing), py = fy(Math.max(spectrum.data[i][line] / factor, top * 1e-7));
      if (line > 1) g.lineTo(px, py); else g.moveTo(px, py);
    }
    g.stroke();
  }));
  g.textAlign = "right";
  chosen.forEach(([c, i], k) => {
    let peak = 1;
    for (let line = 1; line < lines; ++line) if (spectrum.data[i][line] > spectrum.data[i][peak]) peak = line;
    g.fillStyle = seriesColor(k);
    g.fillText(`${c.name}: ${digits(spectrum.data[i][peak] / factor)} ${unit} peak at ${digits(peak * spacing, 4)} Hz`, box.x + box.w - 6, box.y + 14 + 14 * k);
  });
}

const RAMP = [[68, 1, 84], [65, 68, 135], [42, 120, 142], [34, 168, 132], [122, 209, 81], [253, 231, 37]];
function rampColor(f) {
  const at = Math.min(Math.max(f, 0), 1) * (RAMP.length - 1), k = Math.min(RAMP.length - 2, Math.floor(at));
  return RAMP[k].map((c, i) => c + (at - k) * (RAMP[k + 1][i] - c));
}
function addWaterfallRow(frame) {
  const [, index] = spectrumChannels()[0], rows = 240;
  if (!waterfall || waterfall.canvas.width !== frame.n) {
    const canvas = document.createElement("canvas");
    canvas.width = frame.n;
    canvas.height = rows;
    waterfall = { canvas, top: 0, times: [] };
  }
  const values = frame.data[index];
  waterfall.top = Math.max(waterfall.top * 0.999, largest(values.subarray(1)));
  const g = waterfall.canvas.getContext("2d", { willReadFrequently: true });
  g.drawImage(waterfall.canvas, 0, 1);
  const row = g.createImageData(frame.n, 1);
  for (let i = 0; i < frame.n; ++i) {
    const db = 20 * Math.log10((values[i] || 1e-30) / (waterfall.top || 1));
    const [r, gr, b] = rampColor(1 + db / 60);
    row.data.set([r, gr, b, 255], 4 * i);
  }
  g.putImageData(row, 0, 0);
  waterfall.times.unshift(frame.t);
  waterfall.times.length = Math.min(waterfall.times.length, rows);
}
function drawWaterfall() {
  const [g, w, h] = prepare(byId("waterfall"));
  if (!waterfall) return empty(g, w, h, "no block complete yet");
  const [channel] = spectrumChannels()[0];
  const box = { x: 62, y: 6, w: w - 76, h: h - 42 }, rows = waterfall.canvas.height;
  const shown = shownLines(waterfall.canvas.width);
  const newest = waterfall.times[0], oldest = waterfall.times[waterfall.times.length - 1];
  const perRow = waterfall.times.length > 1 ? (newest - oldest) / (waterfall.times.length - 1) : 1;
  axes(g, box, { low: 0, high: stream.spectrum.spacing_hz * (shown - 1), label: "frequency [Hz]" },
    { low: -rows * perRow, high: 0, label: "time before now [s]" });
  g.imageSmoothingEnabled = false;
  g.drawImage(waterfall.canvas, 0, 0, shown, rows, box.x, box.y, box.w, box.h);
  const [factor, unit] = unitFor(channel.quantity, channel.unit, waterfall.top);
  byId("waterfall-state").textContent = `${channel.name}, averaged spectra, 60 dB below ${digits(waterfall.top / factor)} ${unit} peak`;
}

function drawBode() {
  const [g, w, h] = prepare(byId("bode"));
  if (!stream.tracked.length) return empty(g, w, h, "needs the rotor angle: channel beta");
  if (turns.length < 2) return empty(g, w, h, "no full turn yet");
  let low = Infinity, high = -Infinity, size = 0;
  for (const t of turns) {
    low = Math.min(low, t.rpm);
    high = Math.max(high, t.rpm);
    for (const v of t.vectors) size = Math.max(size, Math.hypot(v[0], v[1]));
  }
  if (high - low < 1) { low -= 5; high += 5; }
  const [factor, unit] = unitFor("displacement", "m", size);
  const upper = { x: 62, y: 6, w: w - 76, h: 0.6 * (h - 50) }, lower = { x: 62, y: upper.y + upper.h + 8, w: w - 76, h: 0.4 * (h - 50) };
  const [fx, fa] = axes(g, upper, { low, high }, { low: 0, high: 1.1 * size / factor, label: `1X [${unit}]` }, false);
  const [, fp] = axes(g, lower, { low, high, label: "rotor speed [rpm]" }, { low: -180, high: 180, label: "phase [°]", ticks: [-180, -90, 0, 90, 180].map((v) => [v, String(v).replace("-", "−")]) });
  stream.tracked.forEach((_, k) => {
    g.fillStyle = seriesColor(k);
    for (const t of turns) {
      const [re, im] = t.vectors[k];
      g.fillRect(fx(t.rpm) - 1, fa(Math.hypot(re, im) / factor) - 1, 2, 2);
      g.fillRect(fx(t.rpm) - 1, fp(Math.atan2(im, re) * 180 / Math.PI) - 1, 2, 2);
    }
  });
}

// ---- data --------------------------------------------------------------------------------------------------------
function receive(buffer) {
  const view = new DataView(buffer), magic = view.getUint32(0, true);
  if ((magic & 0xFFFFF000) !== 0x574D1000) return;
  const kind = magic >> 8 & 0xF, group = 2 ** (magic & 0xFF), seq = view.getUint32(4, true);
  const t = Number(view.getBigUint64(8, true)) / 1e9, channels = view.getUint16(16, true), n = view.getUint16(18, true);
  if (lastSeq !== null && seq > lastSeq + 1) missed += seq - lastSeq - 1;
  lastSeq = seq;
  const data = [];
  for (let c = 0; c < channels; ++c) data.push(new Float32Array(buffer, 20 + 4 * c * n, n));
  lastArrival = performance.now();
  const dt = group / stream.rate;
  if (kind === KIND.samples || kind === KIND.minMax) {
    const pairs = kind === KIND.minMax, count = pairs ? n / 2 : n;
    chunks.push({ t, dt, n: count, pairs, data });
    lastTime = t + count * dt;
    while (chunks.length && chunks[0].t < lastTime - 32) chunks.shift();
  }
  if (kind === KIND.samples || kind === KIND.decimated) {
    recent.push({ t, dt, n, data });
    while (recent.length > 1 && recent[0].t + recent[0].n * recent[0].dt < lastTime - RECENT) recent.shift();
  }
  if (kind === KIND.spectrum) {
    spectrum = { t, n, data };
    addWaterfallRow(spectrum);
  }
  if (kind === KIND.synchronous) {
    for (let i = 0; i < n; ++i) {
      const vectors = [];
      for (let c = 1; c + 1 < channels; c += 2) vectors.push([data[c][i], data[c + 1][i]]);
      turns.push({ rpm: data[0][i] * 30 / Math.PI, vectors });
    }
    if (turns.length > 6000) turns.splice(0, turns.length - 6000);
    byId("speed").textContent = `${turns[turns.length - 1].rpm.toFixed(0)} rpm`;
  }
}
function describe(message) {
  stream = message;
  chunks = []; recent = []; spectrum = null; waterfall = null; turns = [];
  byId("stream").textContent = `${stream.name.split("/").pop()}, ${digits(stream.rate, 6)} Hz`;
  document.title = `whirl monitor: ${stream.name.split("/").pop()}`;
  const s = stream.spectrum;
  byId("block").value = s.block;
  byId("win").value = s.window;
  byId("averaging").value = s.averaging;
  byId("averages").value = s.averages;
  byId("record").hidden = !stream.recording_allowed;
}
function showStatus(message) {
  const items = [...message.items, ["frames dropped for this view", String(dropped)], ["frames missed", String(missed)]];
  if (message.recording) items.push(["recording", `${message.record_samples} samples, ${message.record_lost} lost, ${message.record_folder}`]);
  const speed = parseFloat((message.items.find(([key]) => key === "speed") || ["", ""])[1]);
  if (speed && document.activeElement !== byId("play-speed")) byId("play-speed").value = String(speed);
  sourceState = (message.items.find(([key]) => key === "state") || ["", ""])[1];
  byId("status").replaceChildren(...items.flatMap(([key, value]) => {
    const dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = key;
    dd.textContent = value;
    return [dt, dd];
  }));
  const s = stream ? stream.spectrum : null;
  if (s) {
    byId("spectrum-state").textContent = `peak, ${s.window} window (gain corrected), ${s.averaging} average, ` +
      `${message.averages} blocks${message.blocks_skipped ? `, ${message.blocks_skipped} left out` : ""}`;
  }
  byId("record").setAttribute("aria-pressed", String(message.recording));
  byId("record").textContent = message.recording ? "Stop record" : "Record";
  message.log.forEach(addLog);
}
function addLog(line) {
  const item = document.createElement("li");
  item.textContent = line;
  byId("log").prepend(item);
  while (byId("log").children.length > 200) byId("log").lastChild.remove();
}
function send(command, more = {}) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ command, token, ...more }));
}
function connect() {
  socket = new WebSocket(`ws://${location.host}/stream`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { connected = true; lastSeq = null; };
  socket.onclose = () => { connected = false; setTimeout(connect, 1000); };
  socket.onmessage = (event) => {
    if (typeof event.data !== "string") return stream ? receive(event.data) : undefined;
    const message = JSON.parse(event.data);
    if (message.type === "stream") describe(message);
    if (message.type === "status") showStatus(message);
    if (message.type === "client") dropped = message.dropped;
    if (message.type === "refused") addLog("refused: " + message.reason);
  };
}

// ---- page --------------------------------------------------------------------------------------------------------
function showState() {
  const silent = (performance.now() - lastArrival) / 1000, stale = !connected || !lastArrival || silent > 1;
  document.body.classList.toggle("stale", stale);
  const state = byId("state");
  state.className = !connected ? "lost" : stale ? "" : "live";
  const why = sourceState && sourceState !== "playing" ? ` (${sourceState})` : "";
  const text = !connected ? "disconnected" : !lastArrival ? "waiting for data" : stale ? `stale: no data for ${Math.floor(silent)} s${why}` : "live";
  if (state.textContent !== text) state.textContent = text;
  byId("clock").textContent = lastArrival ? `${lastTime.toFixed(2)} s` : "";
}
let drawn = -1;
function draw() {
  requestAnimationFrame(draw);
  showState();
  if (!stream || drawn === lastArrival) return;
  drawn = lastArrival;
  readColors();
  drawTime(); drawOrbit(); drawPhase(); drawSpectrum(); drawWaterfall(); drawBode();
}
if (token) {
  byId("controls").hidden = byId("spectrum-controls").hidden = false;
  for (const button of document.querySelectorAll("[data-command]")) button.onclick = () => send(button.dataset.command);
  byId("play-speed").onchange = (e) => send("speed", { value: Number(e.target.value) });
  byId("record").onclick = (e) => send("record", { value: e.target.getAttribute("aria-pressed") === "true" ? 0 : 1 });
  for (const id of ["block", "win", "averaging", "averages"]) {
    byId(id).onchange = () => send("spectrum", { block: Number(byId("block").value), window: byId("win").value,
      averaging: byId("averaging").value, averages: Number(byId("averages").value) });
  }
}
window.addEventListener("resize", () => { drawn = -1; });
for (const id of ["range", "window"]) byId(id).onchange = () => { drawn = -1; };
connect();
draw();
