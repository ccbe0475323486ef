// Numbers and units as a person reads them.

const PREFIXES = {
  displacement: [[1, "m"], [1e-3, "mm"], [1e-6, "µm"]],
  velocity: [[1, "m/s"], [1e-3, "mm/s"], [1e-6, "µm/s"]],
  force: [[1, "N"], [1e-3, "mN"]],
  voltage: [[1, "V"], [1e-3, "mV"]],
  acceleration: [[1, "m/s²"]],
  time: [[1, "s"], [1e-3, "ms"], [1e-6, "µs"]],
};
export const RPM = Math.PI / 30; // rad/s

/** [SI value of one shown unit, its symbol] that suits values of this size. */
export function unitFor(quantity, si, size) {
  if (quantity === "angular velocity") return [RPM, "rpm"];
  const list = PREFIXES[quantity];
  if (!list) return [1, si === "1" ? "" : si];
  const from = quantity === "displacement" ? 0.1 : 1; // 0.5 mm reads better than 500 µm
  return list.find(([factor]) => size >= factor * from) || list[list.length - 1];
}
export function digits(value, n = 3) {
  return Number.isFinite(value) ? Number(value.toPrecision(n)).toString().replace("-", "−") : "–";
}
export function withUnit(value, quantity, si, n = 3) {
  const [factor, unit] = unitFor(quantity, si, Math.abs(value));
  return `${digits(value / factor, n)} ${unit}`;
}
/** Round values between low and high, at most about `most`, as [value, text]. */
export function ticks(low, high, most) {
  const raw = (high - low) / Math.max(1, most), power = 10 ** Math.floor(Math.log10(raw));
  let step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw * 0.999999);
  if (Math.floor(high / step) === Math.ceil(low / step)) step /= 2; // one tick alone is no scale
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) out.push(k * step);
  const mantissa = step / 10 ** Math.floor(Math.log10(step) + 1e-9);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (Math.abs(mantissa - 2.5) < 1e-6 ? 1 : 0));
  return out.map((v) => [v, v.toFixed(decimals).replace("-", "−")]);
}
export function largest(values) {
  let size = 0;
  for (const v of values) if (Math.abs(v) > size) size = Math.abs(v);
  return size;
}

/** Phases are shown as lag, the industry's way, or as lead: x = Re(Z e^(j beta)). */
export const lags = () => document.getElementById("phase-kind").value === "lag";
