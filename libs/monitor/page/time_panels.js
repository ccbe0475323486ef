// Traces over time: one view of time for all of them, following the newest sample until it is moved.
import { store, channelIndex } from "./store.js";
import { columnsOf } from "./columns.js";
import { unitFor, digits } from "./units.js";
import { prepare, axes, clipped, dashed, line, label, empty, colors, seriesColor } from "./canvas.js";

const byId = (id) => document.getElementById(id);
export const view = { follow: true, end: 0, span: 10 };
const SHORTEST = 0.02, LONGEST = 120; // s

const viewEnd = () => (view.follow ? store.time : view.end);
export function pan(fraction) {
  view.end = viewEnd() + fraction * view.span;
  view.follow = view.end >= store.time;
}
export function zoom(factor, at = 1) {
  const span = Math.min(LONGEST, Math.max(SHORTEST, view.span * factor)), fixed = viewEnd() - (1 - at) * view.span;
  view.end = fixed + (1 - at) * span;
  if (view.end >= store.time) view.follow = true;
  view.span = span;
}
export function follow(on) {
  view.end = viewEnd();
  view.follow = on;
}

/** Fewer samples than pixels: a line through them. More: each column from its smallest to its largest value. A real gap is longer than
    three sample times. */
function drawColumns(g, box, fy, { lows, highs, dt, width }, factor, color) {
  const gap = Math.max(1, 3 * dt / width), dense = dt < 0.5 * width;
  g.strokeStyle = g.fillStyle = color;
  g.lineWidth = 1.2;
  g.beginPath();
  let last = -Infinity, above = 0, below = 0;
  for (let k = 0; k < lows.length; ++k) {
    if (Number.isNaN(lows[k])) continue;
    const joined = k - last <= gap, top = fy(highs[k] / factor), bottom = fy(lows[k] / factor);
    if (dense) {
      // Reaches to the column before, and is never thinner than a line.
      let from = joined ? Math.min(top, below) : top, to = joined ? Math.max(bottom, above) : bottom;
      if (to - from < 1.2) { from = 0.5 * (from + to) - 0.6; to = from + 1.2; }
      g.rect(box.x + k, from, 1, to - from);
    } else {
      const x = box.x + k + 0.5;
      if (joined) g.lineTo(x, top); else g.moveTo(x, top);
      if (bottom !== top) g.lineTo(x, bottom);
    }
    last = k;
    above = top;
    below = bottom;
  }
  if (dense) g.fill(); else g.stroke();
}

/** One row per entry of `rows`: {channels: [index], zero: axis from zero, bounds: [SI], marks: index of a 0/1 channel}. */
function drawRows(canvas, rows) {
  const [g, w, h] = prepare(canvas);
  if (!store.chunks.length || !rows.length) return empty(g, w, h, "no samples yet");
  const columns = Math.max(1, Math.floor(w - 76)), width = view.span / columns;
  const first = Math.floor(viewEnd() / width + 1e-9) - columns + 1, low = first * width, high = low + view.span, each = (h - 34) / rows.length;
  rows.forEach((row, r) => {
    const box = { x: 62, y: 4 + r * each, w: w - 76, h: each - 8 };
    const traces = row.channels.map((i) => columnsOf(i, first, columns, width));
    const size = Math.max(...traces.map((t) => t.size)), channel = store.stream.channels[row.channels[0]];
    const [factor, unit] = unitFor(channel.quantity, channel.unit, size), top = size > 0 ? 1.1 * size / factor : 1;
    const positive = row.zero || traces.every((t) => t.lows.every((v) => !(v < 0)));
    const names = row.channels.map((i) => store.stream.channels[i].name);
    const [, fy] = axes(g, box, { low, high, label: "time [s]" },
      { low: positive ? 0 : -top, high: top, label: `${names.length > 1 ? row.label : names[0]}${unit ? ` [${unit}]` : ""}` }, r === rows.length - 1);
    clipped(g, box, () => {
      g.strokeStyle = colors.text;
      for (const bound of row.bounds || []) {
        dashed(g, () => { line(g, box.x, fy(bound / factor), box.x + box.w, fy(bound / factor)); line(g, box.x, fy(-bound / factor), box.x + box.w, fy(-bound / factor)); });
      }
      traces.forEach((t, k) => drawColumns(g, box, fy, t, factor, row.behind && k === traces.length - 1 ? colors.muted : seriesColor(names.length > 1 ? k : r)));
      if (row.marks >= 0) {
        const flags = columnsOf(row.marks, first, columns, width);
        g.fillStyle = colors.bad;
        flags.highs.forEach((v, k) => { if (v > 0.5) g.fillRect(box.x + k, box.y + box.h - 5, 1, 5); });
      }
    });
    // The channel itself, not the other run that is drawn behind it.
    const peak = Math.max(...(row.behind && traces.length > 1 ? traces.slice(0, -1) : traces).map((t) => t.size));
    const over = row.bounds && row.bounds.some((b) => peak > b) ? "above limit: " : "", most = `${digits(peak / factor)} ${unit} peak in view`;
    const legend = names.length > 1 ? names.map((n, k) => `${n} ${digits(traces[k].newest / factor)}`).join(", ") + ` ${unit}; ` : "";
    const whole = `${over}${legend}${most}`, fits = g.measureText(whole).width < box.w - 12;
    label(g, fits ? whole : over + most, box.x + box.w - 6, box.y + 13, colors.text);
  });
}

const limitOf = (name) => (store.status ? store.status.limits : []).filter((l) => l.channel === name).map((l) => l.limit);
const present = (...names) => names.map(channelIndex).filter((i) => i >= 0);

/** Channels of the large panel: those chosen, otherwise the orbit, otherwise the first four that are no angle. */
export function shownChannels() {
  const chosen = [...document.querySelectorAll("#channels input:checked")].map((c) => Number(c.value));
  return chosen;
}
export function defaultChannels(stream) {
  const orbit = present(...stream.orbit);
  if (orbit.length) return orbit.slice(0, 4);
  return stream.channels.map((c, i) => [c, i]).filter(([c]) => c.quantity !== "angle").map(([, i]) => i).slice(0, 4);
}

export const timePanels = {
  time: () => drawRows(byId("time"), shownChannels().map((i) => {
    const name = store.stream.channels[i].name, open = channelIndex(`${name}_open`);
    return { channels: open >= 0 ? [i, open] : [i], behind: open >= 0, label: name, bounds: limitOf(name) };
  })),
  force: () => {
    const control = store.stream.controls.find((c) => c.name === "force_limit");
    drawRows(byId("force"), [{ channels: present("ux", "uy"), label: "force", bounds: control ? [control.high] : limitOf("ux"), marks: channelIndex("limited") }]);
  },
  sliding: () => drawRows(byId("sliding"), [{ channels: present("s_x", "s_y"), label: "s" }]),
  eccentricity: () => drawRows(byId("eccentricity"), [{ channels: present("e_est"), label: "e", zero: true }]),
};
export const needed = { force: ["ux"], sliding: ["s_x"], eccentricity: ["e_est"], times: ["period"] };

/** Drag pans, wheel and pinch zoom, arrow keys and + - do both. */
export function makeMovable(canvas, changed) {
  const pointers = new Map();
  const width = () => Math.max(1, canvas.clientWidth - 76);
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    pointers.set(e.pointerId, e.clientX);
  });
  canvas.addEventListener("pointermove", (e) => {
    if (!pointers.has(e.pointerId)) return;
    const before = [...pointers.values()];
    const moved = e.clientX - pointers.get(e.pointerId);
    pointers.set(e.pointerId, e.clientX);
    if (before.length === 2) {
      const after = [...pointers.values()], wide = Math.abs(after[0] - after[1]);
      if (wide > 5) zoom(Math.abs(before[0] - before[1]) / wide, 0.5);
    } else {
      pan(-moved / width());
    }
    changed();
  });
  for (const type of ["pointerup", "pointercancel"]) canvas.addEventListener(type, (e) => pointers.delete(e.pointerId));
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    zoom(e.deltaY > 0 ? 1.25 : 0.8, Math.min(1, Math.max(0, (e.offsetX - 62) / width())));
    changed();
  }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const act = { ArrowLeft: () => pan(-0.2), ArrowRight: () => pan(0.2), "+": () => zoom(0.5), "-": () => zoom(2), End: () => follow(true) }[e.key];
    if (!act) return;
    act();
    e.preventDefault();
    changed();
  });
}
