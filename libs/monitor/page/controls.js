// Buttons and keys. What commands needs the token; trip and disarm are always one key away.
import { store } from "./store.js";
import { token, send } from "./transport.js";
import { view, pan, zoom, follow, defaultChannels, needed } from "./time_panels.js";
import { unitFor } from "./units.js";
import { keptChannels, keepChannels } from "./layout.js";

const byId = (id) => document.getElementById(id);
let redraw = () => {};

function offered(name) {
  return token !== null && store.stream !== null && store.stream.controls.some((c) => c.name === name);
}
function control(name) {
  return store.stream.controls.find((c) => c.name === name);
}
function record() {
  send("record", { value: byId("record").getAttribute("aria-pressed") === "true" ? 0 : 1 });
}
function setFollow(on) {
  follow(on);
  byId("follow").setAttribute("aria-pressed", String(view.follow));
  redraw();
}
const KEYS = {
  t: () => offered("trip") && send("trip"),
  d: () => offered("disarm") && send("disarm"),
  a: () => offered("arm") && send("arm"),
  c: () => offered("clear") && send("clear"),
  r: () => token && store.stream.recording_allowed && record(),
  m: () => token && byId("marker").focus(),
  p: () => offered("pause") && send(store.status && store.status.items.some(([k, v]) => k === "state" && v === "playing") ? "pause" : "play"),
  h: () => setFollow(!view.follow),
  "?": () => { byId("help").open = !byId("help").open; },
};

function channelBoxes(stream) {
  const kept = keptChannels(stream.channels.map((c) => c.name));
  const shown = kept ? kept.map((name) => stream.channels.findIndex((c) => c.name === name)) : defaultChannels(stream);
  byId("channels").replaceChildren(...stream.channels.map((c, i) => {
    const item = document.createElement("label"), box = document.createElement("input");
    box.type = "checkbox";
    box.value = i;
    box.checked = shown.includes(i);
    box.onchange = () => {
      keepChannels([...byId("channels").querySelectorAll("input:checked")].map((b) => stream.channels[b.value].name));
      redraw();
    };
    item.append(box, ` ${c.name}`);
    return item;
  }));
}
/** Called with each description of the stream. */
export function showControls(stream) {
  byId("stream").textContent = `${stream.name.split("/").pop()}, ${Number(stream.rate.toPrecision(6))} Hz`;
  document.title = `whirl monitor: ${stream.name.split("/").pop()}`;
  const key = JSON.stringify(stream.channels.map((c) => c.name));
  if (byId("channels").dataset.key !== key) {
    byId("channels").dataset.key = key;
    channelBoxes(stream);
    byId("limit-channel").replaceChildren(...stream.channels.filter((c) => c.quantity !== "angle").map((c) => {
      const option = document.createElement("option"), size = c.quantity === "displacement" ? 1e-3 : 1;
      option.value = c.name;
      option.textContent = `${c.name} [${unitFor(c.quantity, c.unit, size)[1]}]`;
      return option;
    }));
  }
  for (const [id, names] of Object.entries(needed)) byId(id).closest("section").hidden = !names.every((n) => stream.channels.some((c) => c.name === n));
  for (const button of document.querySelectorAll("[data-command]")) {
    button.hidden = button.dataset.command !== "reset" && !offered(button.dataset.command);
  }
  for (const id of ["controls", "spectrum-controls", "limit-controls", "marker-controls"]) byId(id).hidden = token === null;
  byId("speed-control").hidden = !offered("speed");
  byId("seek-control").hidden = !offered("seek");
  byId("force-control").hidden = !offered("force_limit");
  byId("record").hidden = !stream.recording_allowed;
  if (offered("seek")) byId("seek").max = control("seek").high;
  if (offered("force_limit") && !byId("force-limit").value) {
    Object.assign(byId("force-limit"), { min: 0, max: control("force_limit").high, value: control("force_limit").high });
  }
  const s = stream.spectrum;
  Object.entries({ block: s.block, win: s.window, averaging: s.averaging, averages: s.averages }).forEach(([id, value]) => { byId(id).value = value; });
}
/** Called with each status. */
export function showProgress(message) {
  const item = (name) => (message.items.find(([key]) => key === name) || ["", ""])[1];
  if (document.activeElement !== byId("play-speed") && parseFloat(item("speed"))) byId("play-speed").value = String(parseFloat(item("speed")));
  if (document.activeElement !== byId("seek") && item("position")) byId("seek").value = parseFloat(item("position"));
  byId("record").setAttribute("aria-pressed", String(message.recording));
  byId("record").firstChild.textContent = message.recording ? "Stop record" : "Record";
}

export function startControls(changed) {
  redraw = changed;
  for (const button of document.querySelectorAll("[data-command]")) button.onclick = () => send(button.dataset.command);
  byId("record").onclick = record;
  byId("play-speed").onchange = (e) => send("speed", { value: Number(e.target.value) });
  byId("seek").onchange = (e) => send("seek", { value: Number(e.target.value) });
  byId("force-set").onclick = () => send("force_limit", { value: Number(byId("force-limit").value) });
  byId("marker-controls").onsubmit = (e) => {
    e.preventDefault();
    send("marker", { text: byId("marker").value || "marker" });
    byId("marker").value = "";
    byId("marker").blur();
  };
  byId("limit-controls").onsubmit = (e) => {
    e.preventDefault();
    const channel = store.stream.channels.find((c) => c.name === byId("limit-channel").value);
    const [factor] = unitFor(channel.quantity, channel.unit, channel.quantity === "displacement" ? 1e-3 : 1);
    send("limit", { channel: channel.name, value: Number(byId("limit-value").value) * factor });
  };
  for (const id of ["block", "win", "averaging", "averages"]) {
    byId(id).onchange = () => send("spectrum", { block: Number(byId("block").value), window: byId("win").value,
      averaging: byId("averaging").value, averages: Number(byId("averages").value) });
  }
  byId("window").onchange = (e) => { view.span = Number(e.target.value); redraw(); };
  byId("follow").onclick = () => setFollow(!view.follow);
  for (const [id, act] of [["earlier", () => pan(-0.2)], ["later", () => pan(0.2)], ["closer", () => zoom(0.5)], ["wider", () => zoom(2)]]) {
    byId(id).onclick = () => { act(); redraw(); };
  }
  for (const id of ["range", "orbit-span", "orbit-raw", "orbit-1x", "phase-kind"]) byId(id).onchange = () => redraw();
  window.addEventListener("keydown", (e) => {
    if (e.key === "Escape") document.activeElement.blur();
    const typing = e.target === byId("marker");
    if (typing || e.ctrlKey || e.metaKey || e.altKey) return;
    const act = KEYS[e.key.length === 1 ? e.key.toLowerCase() : ""];
    if (!act || !store.stream) return;
    act();
    e.preventDefault();
  });
}
