// Two runs side by side: where in time one lies on the other, and the vector of one at a speed or time of the other.
const GRID = 500;         // points of the longer run
const LEAST_SHARE = 0.4;  // of the shorter run that must lie on the other
const LEAST_SWING = 0.02; // of its speed: below that a run is steady, and its speed says nothing about time

/** Value of `key` between turns at time t, or NaN outside. Turns ascend in time. */
function at(turns, t, key) {
  let low = 0, high = turns.length - 1;
  if (high < 1 || !(t >= turns[0].t && t <= turns[high].t)) return NaN;
  while (high - low > 1) {
    const middle = low + high >> 1;
    if (turns[middle].t <= t) low = middle; else high = middle;
  }
  const a = turns[low], b = turns[high];
  return a[key] + (b[key] - a[key]) * (t - a.t) / Math.max(1e-12, b.t - a.t);
}
function onGrid(turns, step) {
  const n = Math.floor((turns[turns.length - 1].t - turns[0].t) / step) + 1;
  return Float64Array.from({ length: n }, (_, i) => at(turns, turns[0].t + i * step, "rpm"));
}
/** Difference of speeds where b begins `lag` points after a, as a part of how much the speed changes there; Infinity where it does not. */
function misfit(a, b, lag) {
  const from = Math.max(0, lag), to = Math.min(a.length, b.length + lag), n = to - from;
  let sum = 0, squares = 0, apart = 0;
  for (let i = from; i < to; ++i) {
    sum += a[i];
    squares += a[i] * a[i];
    apart += (a[i] - b[i - lag]) ** 2;
  }
  const mean = sum / n, spread = squares / n - mean * mean;
  return spread > (LEAST_SWING * mean) ** 2 ? Math.sqrt(apart / n / spread) : Infinity;
}
/** Seconds to add to the times of run b so that its speeds fall on those of run a: {shift, misfit: 0 the same speeds}; null when neither
    changes its speed, or they share too little. Runs: [{t: s, rpm}] ascending in time. */
export function alignment(a, b) {
  if (a.length < 4 || b.length < 4) return null;
  const length = (turns) => turns[turns.length - 1].t - turns[0].t;
  const step = Math.max(length(a), length(b)) / GRID, first = onGrid(a, step), second = onGrid(b, step);
  const share = Math.max(4, Math.ceil(LEAST_SHARE * Math.min(first.length, second.length)));
  const lags = [];
  for (let lag = share - second.length; lag <= first.length - share; ++lag) lags.push([lag, misfit(first, second, lag)]);
  let best = 0;
  lags.forEach(([, m], i) => { if (m < lags[best][1]) best = i; });
  if (!lags.length || !Number.isFinite(lags[best][1])) return null;
  let [lag] = lags[best]; // between the points of the grid: the vertex of a parabola through the squares of three
  const [l, m, r] = [-1, 0, 1].map((d) => (lags[best + d] ? lags[best + d][1] ** 2 : Infinity));
  if (Number.isFinite(l) && Number.isFinite(r) && l + r > 2 * m) lag += 0.5 * (l - r) / (l - 2 * m + r);
  return { shift: a[0].t - b[0].t + lag * step, misfit: lags[best][1] };
}

/** Vector of run b at time t of run a, [re, im], or null outside. Turns: {t, rpm, re, im}. */
export function atTime(b, t, shift) {
  const re = at(b, t - shift, "re"), im = at(b, t - shift, "im");
  return Number.isNaN(re) ? null : [re, im];
}
const SAME = 0.02; // of the speed, between the turns around it
/** Function (rpm, direction) -> vector of run b at that speed while it changed the same way, [re, im], or null. */
export function bySpeed(b) {
  const runs = [1, -1, 0].map((direction) => b.filter((t) => direction === 0 || t.direction === direction).sort((p, q) => p.rpm - q.rpm));
  return (rpm, direction) => {
    const turns = runs[[1, -1, 0].indexOf(direction)];
    let high = turns.findIndex((t) => t.rpm >= rpm);
    if (high === 0 && turns[0].rpm - rpm < SAME * rpm) high = 1;
    if (high < 1 || high >= turns.length) return null;
    const p = turns[high - 1], q = turns[high];
    if (q.rpm - p.rpm > 5 * SAME * rpm) return null;
    const f = Math.min(1, Math.max(0, (rpm - p.rpm) / Math.max(1e-9, q.rpm - p.rpm)));
    return [p.re + f * (q.re - p.re), p.im + f * (q.im - p.im)];
  };
}
