// What a viewer chose to see: panels, channels, windows. The browser keeps it for the next time, and nothing else.
const byId = (id) => document.getElementById(id);
const KEY = "whirl.layout", FIELDS = ["window", "range", "orbit-span", "orbit-raw", "orbit-1x", "phase-kind", "runs-over", "level-kind"];

function read() {
  try {
    const kept = JSON.parse(localStorage.getItem(KEY));
    return kept && typeof kept === "object" ? kept : {};
  } catch {
    return {}; // storage refused, or not ours
  }
}
function keep(changes) {
  try {
    localStorage.setItem(KEY, JSON.stringify({ ...read(), ...changes }));
  } catch { /* a private window: the choice lasts as long as the page */ }
}

/** Names of the channels chosen before among `names`, or null. */
export function keptChannels(names) {
  const { channels } = read();
  if (!Array.isArray(channels)) return null;
  const known = channels.filter((name) => names.includes(name));
  return known.length ? known : null;
}
export const keepChannels = (names) => keep({ channels: names });

const title = (section) => section.querySelector("h2").firstChild.textContent.trim();
const isBox = (field) => field.type === "checkbox";

/** Restores the choices and keeps each later one. */
export function startLayout(redraw) {
  const kept = read(), off = new Set(Array.isArray(kept.off) ? kept.off : []);
  for (const id of FIELDS) {
    const field = byId(id), value = kept.fields && kept.fields[id];
    if (isBox(field) && typeof value === "boolean") field.checked = value;
    if (!isBox(field) && [...field.options].some((o) => o.value === value)) field.value = value;
    if (value !== undefined) field.dispatchEvent(new Event("change"));
    field.addEventListener("change", () => keep({ fields: { ...read().fields, [id]: isBox(field) ? field.checked : field.value } }));
  }
  byId("panels").replaceChildren(...[...document.querySelectorAll("main > section")].map((section) => {
    const item = document.createElement("label"), box = document.createElement("input"), name = title(section);
    const show = (on) => { section.classList.toggle("off", !on); box.checked = on; };
    box.type = "checkbox";
    box.onchange = () => {
      show(box.checked);
      if (box.checked) off.delete(name); else off.add(name);
      keep({ off: [...off] });
      redraw();
    };
    show(!off.has(name));
    item.append(box, ` ${name}`);
    return item;
  }));
}
