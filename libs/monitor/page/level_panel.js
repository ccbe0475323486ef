// Overall vibration first: one bar a channel against its limit, and the 1X vector with the slow-roll vector taken off.
import { store, setSlowRoll } from "./store.js";
import { withUnit, digits, lags } from "./units.js";

const byId = (id) => document.getElementById(id);
const SPAN = 1;        // s of samples that make a level
const SLOW_TURNS = 16; // whose mean is the slow-roll vector
const MOTION = ["displacement", "velocity", "acceleration"];
// What a limit in peak is in the kind chosen; rms: of a sine.
const KINDS = {
  peak: { of: (s) => Math.max(s.high - s.mean, s.mean - s.low), limit: 1 },
  "p-p": { of: (s) => s.high - s.low, limit: 2 },
  rms: { of: (s) => s.rms, limit: Math.SQRT1_2 },
};

/** Mean, extremes and rms about the mean of the last second of a channel, or null. */
function level(index) {
  let n = 0, sum = 0, squares = 0, low = Infinity, high = -Infinity;
  for (const part of store.recent) {
    for (let i = 0; i < part.n; ++i) {
      const v = part.data[index][i];
      if (part.t + i * part.dt < store.time - SPAN || !Number.isFinite(v)) continue;
      ++n;
      sum += v;
      squares += v * v;
      low = Math.min(low, v);
      high = Math.max(high, v);
    }
  }
  if (n < 8) return null;
  const mean = sum / n;
  return { mean, low, high, rms: Math.sqrt(Math.max(0, squares / n - mean * mean)) };
}
function firstOrder(name) {
  const k = store.stream.tracked.indexOf(name), turn = store.turns[store.turns.length - 1];
  if (k < 0 || !turn) return "";
  const [re, im] = turn.vectors[k], phase = (lags() ? -1 : 1) * Math.atan2(im, re) * 180 / Math.PI;
  return `1X ${withUnit(Math.hypot(re, im), "displacement", "m")} ∠ ${digits((phase + 360) % 360)}°`;
}
function rowOf(list, k) {
  while (list.children.length <= k) {
    const row = document.createElement("li");
    row.innerHTML = '<b></b><span class="value"></span><span class="bar"><i></i><em></em></span><small></small>';
    list.append(row);
  }
  return list.children[k];
}

/** Channels whose 1X is followed, and those with a limit; of a stream without these every motion. */
function shownChannels(limits) {
  const motion = store.stream.channels.map((channel, index) => ({ channel, index })).filter(({ channel }) => MOTION.includes(channel.quantity));
  const chosen = motion.filter(({ channel }) => store.stream.tracked.includes(channel.name) || limits.some((l) => l.channel === channel.name));
  return chosen.length ? chosen : motion;
}

function drawLevels() {
  const list = byId("levels"), kind = KINDS[byId("level-kind").value], limits = store.status ? store.status.limits : [];
  const rows = shownChannels(limits).map(({ channel, index }) => ({ channel, found: level(index) })).filter((r) => r.found);
  const largest = {}; // of each quantity: the scale of channels without a limit
  for (const r of rows) {
    r.size = kind.of(r.found);
    largest[r.channel.quantity] = Math.max(largest[r.channel.quantity] || 0, r.size);
  }
  let k = 0;
  for (const { channel, size } of rows) {
    const limit = limits.find((l) => l.channel === channel.name);
    const row = rowOf(list, k++), [name, value, bar, note] = row.children, [fill, mark] = bar.children;
    const most = limit ? kind.limit * limit.limit : 0, full = limit ? Math.max(1.5 * most, size) : largest[channel.quantity];
    const over = limit && (limit.over || size > most);
    row.className = over ? "over" : limit ? "" : "free";
    name.textContent = channel.name;
    value.textContent = withUnit(size, channel.quantity, channel.unit);
    fill.style.width = `${full > 0 ? 100 * size / full : 0}%`;
    mark.hidden = !limit;
    mark.style.left = `${full > 0 ? 100 * most / full : 0}%`;
    note.textContent = [over ? "⚠ above its limit" : limit ? "below its limit" : "no limit; bar: share of the largest", firstOrder(channel.name)].filter(Boolean).join("; ");
  }
  while (list.children.length > k) list.lastChild.remove();
  byId("levels-none").hidden = k > 0;
  byId("slow-roll").hidden = !store.stream.tracked.length;
}

export function startLevels(redraw) {
  byId("level-kind").addEventListener("change", redraw);
  byId("slow-roll").addEventListener("click", () => {
    const on = byId("slow-roll").getAttribute("aria-pressed") !== "true";
    const taken = setSlowRoll(on ? SLOW_TURNS : 0);
    byId("slow-roll").setAttribute("aria-pressed", String(on && taken !== null));
    byId("slow-roll-state").textContent = !on ? "" : taken === null ? "no full turn yet" : `of ${SLOW_TURNS} turns at ${taken.toFixed(0)} rpm, taken off every 1X vector`;
    redraw();
  });
}
export const levelPanels = { levels: drawLevels };
