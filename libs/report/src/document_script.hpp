#pragma once
#include <string_view>

namespace whirl::report {

/// Script of the page: values under the pointer with cursors linked over panels of the same axis, zoom, series on and
/// off. Without it the page is complete; it reads only what the drawings carry (`data-p` of a plot area: the limits of
/// its axes).
inline constexpr std::string_view kDocumentScript = R"js(//<![CDATA[
(() => {
"use strict";
const NS = "http://www.w3.org/2000/svg";
const make = (name, attributes, parent) => {
  const e = document.createElementNS(NS, name);
  for (const k in attributes) e.setAttribute(k, attributes[k]);
  if (parent) parent.append(e);
  return e;
};
const number = v => {
  const a = Math.abs(v);
  return a !== 0 && (a >= 1e5 || a < 1e-3) ? v.toExponential(3) : String(+v.toPrecision(5));
};
// Limits low and high of an axis; position is 0 at low and 1 at high.
const position = (axis, v) => axis.log ? Math.log(v / axis.low) / Math.log(axis.high / axis.low) : (v - axis.low) / (axis.high - axis.low);
const value = (axis, p) => axis.log ? axis.low * Math.pow(axis.high / axis.low, p) : axis.low + p * (axis.high - axis.low);
const ticks = (low, high, count) => {
  const raw = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = power * [1, 2, 5, 10].find(s => s * power >= raw * 0.999);
  const out = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + 1e-9 * step; v += step) out.push(Math.abs(v) < step * 1e-6 ? 0 : v);
  return out;
};
const logTicks = (low, high) => {
  const out = [];
  for (let d = Math.floor(Math.log10(low)); d <= Math.ceil(Math.log10(high)); ++d) out.push(Math.pow(10, d));
  const inside = out.filter(v => v >= low && v <= high);
  return inside.length > 1 ? inside : ticks(low, high, 5);
};

class Panel {
  constructor(area) {
    const p = JSON.parse(area.dataset.p);
    this.area = area;
    this.svg = area.ownerSVGElement;
    this.box = {x: +area.getAttribute("x"), y: +area.getAttribute("y"), w: +area.getAttribute("width"), h: +area.getAttribute("height")};
    this.x = p.x;
    this.y = p.y;
    this.full = {x: {...p.x}, y: {...p.y}};
    this.marks = this.svg.querySelector(`g.lb[data-a="${area.dataset.a}"]`);
    this.cursor = make("path", {class: "cur", d: ""}, area);
    this.select = make("rect", {class: "sel", width: 0, height: 0}, area);
    this.read = make("g", {class: "rd"}, this.svg);
  }
  series() {
    if (!this.lines) {
      this.lines = [...this.area.querySelectorAll(":scope > g.sr")].map(g => ({g, name: g.dataset.n, points: vertices(g)}));
    }
    return this.lines.filter(s => s.g.style.display !== "none" && s.points.length);
  }
  // Place in the drawing as it was made, for a pointer on the screen.
  place(event) {
    const m = this.area.getScreenCTM().inverse();
    return new DOMPoint(event.clientX, event.clientY).matrixTransform(m);
  }
  home(axis, px) { // value of a place in the unzoomed drawing
    return axis === "x" ? value(this.full.x, (px - this.box.x) / this.box.w) : value(this.full.y, (this.box.y + this.box.h - px) / this.box.h);
  }
  px(axis, v) {
    return axis === "x" ? this.box.x + this.box.w * position(this.full.x, v) : this.box.y + this.box.h * (1 - position(this.full.y, v));
  }
  show(x, withNames) {
    const at = this.px("x", x), left = this.px("x", this.x.low), right = this.px("x", this.x.high);
    this.hide();
    if (!(at >= left && at <= right)) return;
    const top = this.px("y", this.y.high), bottom = this.px("y", this.y.low);
    this.cursor.setAttribute("d", `M${at} ${top}V${bottom}`);
    const rows = [`${this.x.name ? this.x.name + " " : ""}${number(x)}${this.x.unit ? " " + this.x.unit : ""}`];
    for (const s of this.series()) {
      const v = nearest(s.points, at);
      if (v !== null) rows.push(`${s.name ? s.name + " " : ""}${number(this.home("y", v))}${this.y.unit ? " " + this.y.unit : ""}`);
    }
    const shown = withNames ? rows : rows.slice(0, 6);
    const share = (at - left) / (right - left), width = 7 + 6.1 * Math.max(...shown.map(r => r.length)), height = 6 + 14 * shown.length;
    const screen = this.box.x + share * this.box.w;
    const rx = share > 0.5 ? screen - width - 8 : screen + 8;
    make("rect", {x: rx, y: this.box.y + 6, width, height, rx: 3}, this.read);
    shown.forEach((r, i) => { make("text", {x: rx + 5, y: this.box.y + 19 + 14 * i}, this.read).textContent = r; });
  }
  hide() {
    this.cursor.setAttribute("d", "");
    this.read.replaceChildren();
  }
  zoom(x, y) {
    if (x) Object.assign(this.x, x);
    if (y) Object.assign(this.y, y);
    const left = this.px("x", this.x.low), top = this.px("y", this.y.high);
    const w = this.px("x", this.x.high) - left, h = this.px("y", this.y.low) - top;
    this.area.setAttribute("viewBox", `${left} ${top} ${w} ${h}`);
    this.area.setAttribute("preserveAspectRatio", "none");
    this.area.classList.add("zoomed");
    if (this.marks) this.marks.style.display = this.whole() ? "" : "none";
    this.label();
  }
  whole() { return ["x", "y"].every(k => this[k].low === this.full[k].low && this[k].high === this.full[k].high); }
  label() {
    const b = this.box;
    for (const k of ["x", "y"]) {
      const g = this.svg.querySelector(`g.t${k}[data-a="${this.area.dataset.a}"]`);
      if (!g) continue;
      if (!this.original) this.original = {};
      if (!this.original[k]) this.original[k] = [...g.childNodes];
      if (this[k].low === this.full[k].low && this[k].high === this.full[k].high) {
        g.replaceChildren(...this.original[k]);
        continue;
      }
      const named = this.original[k].some(e => e.nodeName === "text");
      g.replaceChildren();
      const list = this[k].log ? logTicks(this[k].low, this[k].high) : ticks(this[k].low, this[k].high, k === "x" ? b.w / 80 : b.h / 40);
      for (const v of list) {
        const p = position(this[k], v);
        if (k === "x") {
          const x = b.x + b.w * p;
          make("path", {class: "ax", d: `M${x} ${b.y + b.h}v4`}, g);
          if (named) make("text", {x, y: b.y + b.h + 16, "text-anchor": "middle"}, g).textContent = number(v);
        } else {
          const y = b.y + b.h * (1 - p);
          make("path", {class: "ax", d: `M${b.x} ${y}h-4`}, g);
          make("text", {x: b.x - 7, y: y + 4, "text-anchor": "end"}, g).textContent = number(v);
        }
      }
    }
  }
}

// Corners of the lines of a series, sorted by x; bars and marks have none.
function vertices(g) {
  const out = [];
  for (const path of g.querySelectorAll('path[class^="s"]:not([stroke-width="1.4"])')) {
    let x = 0, y = 0;
    for (const [, c, rest] of (path.getAttribute("d") || "").matchAll(/([a-zA-Z])([^a-zA-Z]*)/g)) {
      const n = (rest.match(/-?\d*\.?\d+/g) || []).map(Number);
      for (let i = 0; i + 1 < n.length; i += 2) {
        if (c === "M" || c === "L") { x = n[i]; y = n[i + 1]; } else { x += n[i]; y += n[i + 1]; }
        out.push([x, y]);
      }
    }
  }
  return out.sort((a, b) => a[0] - b[0]);
}
function nearest(points, x) {
  let low = 0, high = points.length - 1;
  if (x < points[0][0] - 3 || x > points[high][0] + 3) return null;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (points[middle][0] < x) low = middle; else high = middle;
  }
  const a = points[low], b = points[high], d = b[0] - a[0];
  return d < 2 ? a[1] : a[1] + (b[1] - a[1]) * Math.min(1, Math.max(0, (x - a[0]) / d));
}

const panels = [...document.querySelectorAll("svg.wf svg[data-p]")].map(a => new Panel(a));
const linked = p => panels.filter(q => q === p || (q.x.key && q.x.key === p.x.key));
let queued = null;
for (const p of panels) {
  let start = null;
  p.area.addEventListener("pointermove", event => {
    const at = p.place(event);
    if (start) {
      p.select.setAttribute("x", Math.min(start.x, at.x));
      p.select.setAttribute("y", Math.min(start.y, at.y));
      p.select.setAttribute("width", Math.abs(at.x - start.x));
      p.select.setAttribute("height", Math.abs(at.y - start.y));
      return;
    }
    cancelAnimationFrame(queued);
    queued = requestAnimationFrame(() => { for (const q of linked(p)) q.show(p.home("x", at.x), q === p); });
  });
  p.area.addEventListener("pointerleave", () => { if (!start) { cancelAnimationFrame(queued); for (const q of linked(p)) q.hide(); } });
  p.area.addEventListener("pointerdown", event => {
    if (event.pointerType === "touch" || event.button !== 0) return;
    start = p.place(event);
    p.area.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  p.area.addEventListener("pointerup", event => {
    if (!start) return;
    const at = p.place(event), from = start;
    start = null;
    p.select.setAttribute("width", 0);
    p.select.setAttribute("height", 0);
    const across = Math.abs(at.x - from.x) / (p.px("x", p.x.high) - p.px("x", p.x.low));
    const down = Math.abs(at.y - from.y) / (p.px("y", p.y.low) - p.px("y", p.y.high));
    if (across < 0.02 && down < 0.05) return;
    const ends = (k, a, b) => ({low: Math.min(p.home(k, a), p.home(k, b)), high: Math.max(p.home(k, a), p.home(k, b))});
    const x = across < 0.02 ? null : ends("x", from.x, at.x);
    p.zoom(x, down < 0.05 ? null : ends("y", from.y, at.y));
    if (x) for (const q of linked(p)) if (q !== p && q.svg === p.svg) q.zoom(x, null);
  });
  p.area.addEventListener("dblclick", () => {
    for (const q of linked(p)) if (q.svg === p.svg) q.zoom({low: q.full.x.low, high: q.full.x.high}, {low: q.full.y.low, high: q.full.y.high});
  });
}
for (const entry of document.querySelectorAll("svg.wf g.lg")) {
  entry.setAttribute("role", "button");
  entry.setAttribute("tabindex", "0");
  const toggle = () => {
    const off = entry.classList.toggle("off");
    for (const g of entry.ownerSVGElement.querySelectorAll(`svg[data-a="${entry.dataset.a}"] > g.sr`))
      if (g.dataset.n === entry.dataset.n) g.style.display = off ? "none" : "";
    entry.setAttribute("aria-pressed", off ? "false" : "true");
  };
  entry.addEventListener("click", toggle);
  entry.addEventListener("keydown", e => { if (e.key === "Enter" || e.key === " ") { e.preventDefault(); toggle(); } });
}
if (panels.length) document.documentElement.classList.add("live");
})();
//]]>)js";

}  // namespace whirl::report
