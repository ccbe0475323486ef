// The loop and the log: times, limits, status, events.
import { store } from "./store.js";
import { digits, withUnit } from "./units.js";
import { prepare, axes, empty, label, colors, seriesColor } from "./canvas.js";

const byId = (id) => document.getElementById(id);
const MOST_LINES = 300;
const micro = (s) => `${digits(1e6 * s)} µs`;

function drawTimes() {
  const [g, w, h] = prepare(byId("times")), all = (store.status ? store.status.times : []).filter((t) => t.total > 0);
  if (!all.length) return empty(g, w, h, "no times of a loop in this stream");
  const each = (h - 20) / all.length;
  all.forEach((t, r) => {
    const box = { x: 62, y: 6 + r * each, w: w - 76, h: each - 42 };
    const low = t.octaves[0][0] * 1e6, high = t.octaves[t.octaves.length - 1][0] * 2e6;
    const [fx, fy] = axes(g, box, { low, high: Math.max(high, 4 * low), label: `${t.name} [µs]`, log: true },
      { low: 0.5, high: 10 ** Math.ceil(Math.log10(2 * t.total)), label: "cycles", log: true });
    g.fillStyle = seriesColor(r);
    for (const [from, n] of t.octaves) g.fillRect(fx(from * 1e6) + 1, fy(n), fx(from * 2e6) - fx(from * 1e6) - 2, box.y + box.h - fy(n));
    label(g, `p50 ${micro(t.p50)}, p99 ${micro(t.p99)}, p99.9 ${micro(t.p999)}, max ${micro(t.max)}`, box.x + box.w - 6, box.y + 13, colors.text);
  });
}
export const loopPanels = { times: drawTimes };

function fillList(id, pairs) {
  byId(id).replaceChildren(...pairs.flatMap(([key, value]) => {
    const dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = key;
    dd.textContent = value;
    return [dt, dd];
  }));
}
export function showStatus(message, rate) {
  const items = [...message.items, ["speed trend", message.trend], ["frames dropped for this view", String(store.dropped)],
    ["frames missed", String(store.missed)], ["frames drawn per second", `${rate.frames.toFixed(0)}, ${rate.milliseconds.toFixed(0)} ms each`]];
  if (message.recording) items.push(["recording", `${message.record_samples} samples, ${message.record_lost} lost, ${message.record_folder}`]);
  fillList("status", items);
  const rows = message.limits.map((l) => {
    const channel = store.stream.channels.find((c) => c.name === l.channel), row = document.createElement("tr");
    row.className = l.over ? "over" : "";
    for (const text of [l.channel, withUnit(l.limit, channel.quantity, channel.unit), withUnit(l.largest, channel.quantity, channel.unit), String(l.crossings), l.over ? "⚠ above" : "below"]) {
      const cell = document.createElement("td");
      cell.textContent = text;
      row.append(cell);
    }
    return row;
  });
  byId("limits").replaceChildren(...rows);
  byId("limits-none").hidden = rows.length > 0;
  const over = message.limits.filter((l) => l.over).map((l) => l.channel);
  const alarm = over.length ? `alarm: ${over.join(", ")} above limit` : "";
  if (byId("alarm").textContent !== alarm) byId("alarm").textContent = alarm;
  const s = store.stream.spectrum;
  byId("spectrum-state").textContent = `peak, ${s.window} window (gain corrected), ${s.averaging} average, ` +
    `${message.averages} blocks${message.blocks_bridged ? `, lost samples bridged in ${message.blocks_bridged}` : ""}` +
    `${message.blocks_skipped ? `, ${message.blocks_skipped} left out: over 1 % lost` : ""}`;
}
export function addLog(lines, all) {
  if (all) byId("log").replaceChildren();
  for (const text of lines) {
    const item = document.createElement("li");
    item.textContent = text;
    byId("log").prepend(item);
  }
  while (byId("log").children.length > MOST_LINES) byId("log").lastChild.remove();
}
