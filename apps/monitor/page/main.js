// Live view of a stream of frames, without libraries. One file per idea; this one puts them together and draws.
import { store } from "./store.js";
import { connect } from "./transport.js";
import { readColors } from "./canvas.js";
import { timePanels, makeMovable, view } from "./time_panels.js";
import { orbitPanels } from "./orbit_panels.js";
import { spectrumPanels } from "./spectrum_panels.js";
import { speedPanels } from "./speed_panels.js";
import { loopPanels, showStatus, addLog } from "./loop_panels.js";
import { startControls, showControls, showProgress } from "./controls.js";

const byId = (id) => document.getElementById(id);
const panels = { ...timePanels, ...orbitPanels, ...spectrumPanels, ...speedPanels, ...loopPanels };
const visible = new Set(), dirty = new Set(), drawnAt = {};
const SLOW = 200; // ms between two drawings of what does not move
let drawn = -1, shown = -1, count = 0, busy = 0, since = performance.now(), rate = { frames: 0, milliseconds: 0 };
const redraw = () => {
  drawn = -1;
  for (const id of Object.keys(drawnAt)) drawnAt[id] = -Infinity;
};
const resting = (id) => !(id in timePanels) && id !== "orbit" && id !== "phase" && performance.now() - drawnAt[id] < SLOW;

function showState() {
  const silent = (performance.now() - store.arrival) / 1000, stale = !store.connected || !store.arrival || silent > 1;
  document.body.classList.toggle("stale", stale);
  const source = store.status ? (store.status.items.find(([key]) => key === "state") || ["", ""])[1] : "";
  const text = !store.connected ? "disconnected" : !store.arrival ? "waiting for data"
    : stale ? `stale: no data for ${Math.floor(silent)} s${source ? ` (${source})` : ""}` : source && source !== "playing" ? `live, ${source}` : "live";
  const state = byId("state");
  state.className = !store.connected || source.startsWith("tripped") ? "lost" : stale ? "" : "live";
  if (state.textContent !== text) state.textContent = text;
  byId("clock").textContent = store.arrival ? `${store.time.toFixed(2)} s` : "";
  const turn = store.turns[store.turns.length - 1], trend = store.status && store.status.trend !== "steady" ? `, ${store.status.trend}` : "";
  byId("speed").textContent = turn ? `${turn.rpm.toFixed(0)} rpm${trend}` : "";
  byId("follow").setAttribute("aria-pressed", String(view.follow));
}
function draw() {
  requestAnimationFrame(draw);
  showState();
  if (!store.stream) return;
  if (drawn !== store.arrival || shown !== store.status) for (const id of visible) dirty.add(id);
  drawn = store.arrival;
  shown = store.status;
  const due = [...dirty].filter((id) => !resting(id)), begin = performance.now();
  if (!due.length) return;
  readColors();
  for (const id of due) {
    dirty.delete(id);
    drawnAt[id] = begin;
    if (!byId(id).closest("section").hidden) panels[id]();
  }
  ++count;
  const now = performance.now();
  busy += now - begin;
  if (now - since > 1000) {
    rate = { frames: 1000 * count / (now - since), milliseconds: busy / count };
    count = busy = 0;
    since = now;
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
connect({
  stream: showControls,
  status: (message) => { showStatus(message, rate); showProgress(message); },
  log: addLog,
});
draw();
