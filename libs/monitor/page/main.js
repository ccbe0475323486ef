// Live view of a stream of frames, without libraries. One file per idea; this one puts them together and draws.
import { store } from "./store.js";
import { connect } from "./transport.js";
import { readColors } from "./canvas.js";
import { timePanels, makeMovable, view } from "./time_panels.js";
import { orbitPanels } from "./orbit_panels.js";
import { spectrumPanels } from "./spectrum_panels.js";
import { speedPanels } from "./speed_panels.js";
import { levelPanels, startLevels } from "./level_panel.js";
import { runsPanels } from "./runs_panel.js";
import { loopPanels, showStatus, addLog } from "./loop_panels.js";
import { startControls, showControls, showProgress } from "./controls.js";
import { startLayout } from "./layout.js";
import { startOpen, showOpen } from "./open.js";

const byId = (id) => document.getElementById(id);
const panels = { ...timePanels, ...orbitPanels, ...spectrumPanels, ...speedPanels, ...runsPanels, ...loopPanels, ...levelPanels };
const visible = new Set(), dirty = new Set(), drawnAt = {};
const FAST = 20, SLOW = 200; // least ms between two drawings of what moves, and of what does not
let drawn = -1, shown = -1, count = 0, busy = 0, since = performance.now(), begun = 0, rate = { frames: 0, milliseconds: 0 };
const redraw = () => {
  drawn = -1;
  for (const id of Object.keys(drawnAt)) drawnAt[id] = -Infinity;
};
const moves = (id) => id in timePanels || id === "orbit" || id === "phase";
/** What moves, what has to be drawn anew, and of the others the one that has waited longest: together they would hold up what moves. */
function due(now) {
  const first = (id) => moves(id) || !Number.isFinite(drawnAt[id]);
  const still = [...dirty].filter((id) => !first(id) && now - drawnAt[id] >= SLOW);
  still.sort((a, b) => drawnAt[a] - drawnAt[b]);
  return [...[...dirty].filter(first), ...still.slice(0, 1)];
}
const say = (id, text) => { if (byId(id).textContent !== text) byId(id).textContent = text; };

function showState() {
  const silent = (performance.now() - store.arrival) / 1000, stale = !store.connected || !store.arrival || silent > 1;
  document.body.classList.toggle("stale", stale);
  const source = store.status ? (store.status.items.find(([key]) => key === "state") || ["", ""])[1] : "";
  const text = !store.connected ? "disconnected" : !store.arrival ? "waiting for data"
    : stale ? `stale: no data for ${Math.floor(silent)} s${source ? ` (${source})` : ""}` : source && source !== "playing" ? `live, ${source}` : "live";
  byId("state").className = !store.connected || source.startsWith("tripped") ? "lost" : stale ? "" : "live";
  say("state", text);
  say("clock", store.arrival ? `${store.time.toFixed(1)} s` : "");
  const turn = store.turns[store.turns.length - 1], trend = store.status && store.status.trend !== "steady" ? `, ${store.status.trend}` : "";
  say("speed", turn ? `${turn.rpm.toFixed(0)} rpm${trend}` : "");
  say("rate", rate.frames ? `${rate.frames.toFixed(0)} frames/s${store.missed ? `, ${store.missed} dropped` : ""}` : "");
  byId("follow").setAttribute("aria-pressed", String(view.follow));
}
function draw() {
  requestAnimationFrame(draw);
  const begin = performance.now();
  if (begin - begun < FAST) return;
  showState();
  if (!store.stream) return;
  if (drawn !== store.arrival || shown !== store.status) for (const id of visible) dirty.add(id);
  drawn = store.arrival;
  shown = store.status;
  const now = due(begin);
  if (!now.length) return;
  begun = begin;
  readColors();
  for (const id of now) {
    dirty.delete(id);
    drawnAt[id] = begin;
    if (!byId(id).closest("section").hidden) panels[id]();
  }
  ++count;
  const end = performance.now();
  busy += end - begin;
  if (end - since > 1000) {
    rate = { frames: 1000 * count / (end - since), milliseconds: busy / count };
    count = busy = 0;
    since = end;
  }
}

// Only what can be seen is drawn.
const observer = new IntersectionObserver((entries) => {
  for (const e of entries) if (e.isIntersecting) visible.add(e.target.id); else { visible.delete(e.target.id); dirty.delete(e.target.id); }
  redraw();
}, { rootMargin: "100px" });
for (const id of Object.keys(panels)) observer.observe(byId(id));
for (const id of Object.keys(timePanels)) makeMovable(byId(id), redraw);
window.addEventListener("resize", redraw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
startControls(redraw);
startLayout(redraw);
startLevels(redraw);
startOpen();
byId("runs-over").addEventListener("change", redraw);
connect({
  stream: (message) => { showControls(message); showOpen(); redraw(); },
  status: (message) => { showStatus(message, rate); showProgress(message); },
  log: addLog,
});
draw();
