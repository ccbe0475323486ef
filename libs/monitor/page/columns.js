// Smallest and largest value of each pixel column of a view of time. Columns lie on a fixed grid of time, so that a view that
// follows the newest sample only works out what the newest frames touch.
import { store } from "./store.js";

const kept = new Map(), MOST_KEPT = 64;

/** Takes the samples of a chunk into the columns. */
function add(c, chunk, index) {
  const data = chunk.data[index], scale = chunk.dt / c.width, offset = chunk.t / c.width - c.first;
  const each = chunk.pairs ? 2 : 1;
  c.dt = chunk.dt;
  if (offset + chunk.n * scale < 0) return;
  for (let i = Math.max(0, each * Math.floor(-offset / scale)); i < data.length; ++i) {
    const column = Math.floor(offset + (chunk.pairs ? i >> 1 : i) * scale), v = data[i];
    if (column >= c.count) {
      c.complete = false; // newer samples than the view shows
      return;
    }
    if (column < 0 || Number.isNaN(v)) continue;
    if (!(c.lows[column] <= v)) c.lows[column] = v;
    if (!(c.highs[column] >= v)) c.highs[column] = v;
    c.newest = v;
  }
}
/** Moves the columns to a later first one; false when they have to be worked out anew. */
function move(c, first) {
  const shift = first - c.first;
  if (shift < 0 || shift >= c.count || (shift > 0 && !c.complete)) return false;
  for (const values of shift > 0 ? [c.lows, c.highs] : []) {
    values.copyWithin(0, shift);
    values.fill(NaN, c.count - shift);
  }
  c.first = first;
  return true;
}

/** Columns of channel `index`: column k of the grid covers [k, k + 1) * width seconds; `count` of them from `first` on.
    {lows, highs: NaN where nothing came, size: largest |value|, newest, dt: s between samples}. */
export function columnsOf(index, first, count, width) {
  const key = `${index}/${count}/${width}`;
  let c = kept.get(key), next = c ? store.chunks.lastIndexOf(c.chunk) + 1 : 0;
  if (next === 0 || !move(c, first)) {
    if (kept.size >= MOST_KEPT) kept.clear();
    c = { first, count, width, complete: true, newest: NaN, dt: 0, lows: new Float64Array(count).fill(NaN), highs: new Float64Array(count).fill(NaN) };
    kept.set(key, c);
    next = 0;
  }
  for (; next < store.chunks.length; ++next) add(c, store.chunks[next], index);
  c.chunk = store.chunks[store.chunks.length - 1];
  c.size = 0;
  for (let k = 0; k < count; ++k) c.size = Math.max(c.size, Math.abs(c.lows[k]) || 0, Math.abs(c.highs[k]) || 0);
  return c;
}
