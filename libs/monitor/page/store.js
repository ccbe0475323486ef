// What the page knows of the stream. Bounded: old samples go.
import { RPM } from "./units.js";

export const KIND = { samples: 1, minMax: 2, decimated: 3, spectrum: 4, synchronous: 5, full: 6, waterfall: 7 };
const HISTORY = 120;          // s of time traces
const MOST_VALUES = 12e6;     // of all channels together
const RECENT = 4;             // s of raw samples for orbit and phase plane
const MOST_TURNS = 8000;
export const WATERFALL_ROWS = 240;

export const store = {
  stream: null, status: null,
  chunks: [], values: 0,      // time: {t, dt, n, pairs, data: Float32Array per channel}
  recent: [], spectrum: null, full: null, waterfall: [], turns: [],
  slowRoll: null,             // vector a tracked channel that is taken off, or null
  time: 0, arrival: 0, missed: 0, dropped: 0, connected: false, log: [],
};
let lastSeq = null;

export const channelIndex = (name) => (store.stream ? store.stream.channels.findIndex((c) => c.name === name) : -1);

export function connectedAnew() {
  store.connected = true;
  lastSeq = null;
}
export function describe(message) {
  const same = store.stream && store.stream.opened === message.opened && store.stream.name === message.name && store.stream.channels.length === message.channels.length;
  store.stream = message;
  if (!same) Object.assign(store, { chunks: [], values: 0, recent: [], turns: [], slowRoll: null });
  Object.assign(store, { spectrum: null, full: null, waterfall: [] });
}
/** Last sample of a channel, or NaN. */
export function latest(index) {
  const c = store.chunks[store.chunks.length - 1];
  return c && index >= 0 && c.data[index].length ? c.data[index][c.data[index].length - 1] : NaN;
}
/** Speed at time t between turns, rpm, or NaN. */
export function speedAt(t) {
  const turns = store.turns;
  for (let i = turns.length - 1; i > 0; --i) {
    const a = turns[i - 1], b = turns[i];
    if (t > b.t + 2) return NaN;
    if (t >= a.t || i === 1) return a.rpm + (b.rpm - a.rpm) * Math.min(1, Math.max(-1, (t - a.t) / Math.max(1e-9, b.t - a.t)));
  }
  return NaN;
}

/** 1 where the speed rises from turn to turn, -1 where it falls, 0 where it is steady or the turns before are far away. */
export function directionAt(turns, i) {
  const before = turns[Math.max(0, i - 8)], turn = turns[i], change = before ? (turn.rpm - before.rpm) / Math.max(turn.rpm, 1) : 0;
  return before && turn.t - before.t < 3 ? (change > 0.004 ? 1 : change < -0.004 ? -1 : 0) : 0;
}
const without = (measured) => (store.slowRoll ? measured.map(([re, im], k) => [re - store.slowRoll[k][0], im - store.slowRoll[k][1]]) : measured);
/** Takes the mean vector of the last `count` turns off all turns, those to come too; 0: none any more. Their speed in rpm, or null. */
export function setSlowRoll(count) {
  const slow = count > 0 ? store.turns.slice(-count) : [], mean = (f) => slow.reduce((sum, t) => sum + f(t), 0) / slow.length;
  store.slowRoll = slow.length ? slow[0].measured.map((_, k) => [mean((t) => t.measured[k][0]), mean((t) => t.measured[k][1])]) : null;
  for (const t of store.turns) t.vectors = without(t.measured);
  return slow.length ? mean((t) => t.rpm) : null;
}
function addTurns(t, data, channels, n) {
  const armed = latest(channelIndex("armed"));
  for (let i = 0; i < n; ++i) {
    const measured = [];
    for (let c = 2; c + 1 < channels; c += 2) measured.push([data[c][i], data[c + 1][i]]);
    store.turns.push({ t: t + data[1][i], rpm: Math.abs(data[0][i]) / RPM, open: armed < 0.5, measured, vectors: without(measured) });
    store.turns[store.turns.length - 1].direction = directionAt(store.turns, store.turns.length - 1);
  }
  if (store.turns.length > MOST_TURNS) store.turns.splice(0, store.turns.length - MOST_TURNS);
}

/** A binary frame as in libs/monitor/include/whirl/monitor/frame.hpp. */
export function receive(buffer) {
  if (buffer.byteLength < 20) return;
  const view = new DataView(buffer), magic = view.getUint32(0, true);
  if ((magic & 0xFFFFF000) !== 0x574D1000) return;
  const kind = magic >> 8 & 0xF, group = 2 ** (magic & 0xFF), seq = view.getUint32(4, true);
  const t = Number(view.getBigUint64(8, true)) / 1e9, channels = view.getUint16(16, true), n = view.getUint16(18, true);
  if (lastSeq !== null && seq > lastSeq + 1) store.missed += seq - lastSeq - 1;
  lastSeq = seq;
  const data = [];
  for (let c = 0; c < channels; ++c) data.push(new Float32Array(buffer, 20 + 4 * c * n, n));
  store.arrival = performance.now();
  const dt = group / store.stream.rate;
  if (kind === KIND.samples || kind === KIND.minMax) {
    const pairs = kind === KIND.minMax, count = pairs ? n / 2 : n;
    store.chunks.push({ t, dt, n: count, pairs, data });
    store.values += n * channels;
    store.time = t + count * dt;
    while (store.chunks.length > 1 && (store.chunks[0].t < store.time - HISTORY || store.values > MOST_VALUES)) {
      const old = store.chunks.shift();
      store.values -= old.data.length * old.data[0].length;
    }
  }
  if (kind === KIND.samples || kind === KIND.decimated) {
    store.recent.push({ t, dt, n, data });
    while (store.recent.length > 1 && store.recent[0].t + store.recent[0].n * store.recent[0].dt < store.time - RECENT) store.recent.shift();
  }
  if (kind === KIND.spectrum) store.spectrum = { t, n, data };
  if (kind === KIND.full) store.full = { t, n, data: data[0] };
  if (kind === KIND.synchronous) addTurns(t, data, channels, n);
  if (kind === KIND.waterfall) {
    store.waterfall.unshift({ t, n, data: data[0], drawn: false });
    store.waterfall.length = Math.min(store.waterfall.length, WATERFALL_ROWS);
  }
}
