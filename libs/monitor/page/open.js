// Recordings that are dropped on the page or chosen from a list of files: played in place of the one shown, or compared with it.
import { store } from "./store.js";
import { token } from "./transport.js";

const byId = (id) => document.getElementById(id);
const ZONES = { played: "open-played", compared: "open-compared" };

const may = (as) => token !== null && store.stream !== null && store.stream.opens[as === "played" ? "play" : "compare"];
const carriesFile = (e) => e.dataTransfer !== null && [...e.dataTransfer.types].includes("Files");
const say = (text) => { byId("open-state").textContent = text; };

async function send(file, as) {
  say(`sending ${file.name} …`);
  try {
    const answer = await fetch(`/open/${as}`, { method: "POST", headers: { "X-Whirl-Token": token, "X-Whirl-Name": encodeURIComponent(file.name) }, body: file });
    say(await answer.text());
  } catch {
    say(`${file.name}: the connection broke off`); // the server ends what is too large or takes too long
  }
}

/** Shows what may be opened with this stream. */
export function showOpen() {
  byId("open").hidden = !may("played") && !may("compared");
  for (const [as, zone] of Object.entries(ZONES)) byId(zone).hidden = !may(as);
}

export function startOpen() {
  let depth = 0; // a drag enters an element before it leaves the one around it
  const show = (on) => byId("open").classList.toggle("over", on);
  document.addEventListener("dragenter", (e) => { if (carriesFile(e) && ++depth > 0) show(true); });
  document.addEventListener("dragleave", (e) => { if (carriesFile(e) && --depth <= 0) { depth = 0; show(false); } });
  document.addEventListener("dragover", (e) => { if (carriesFile(e)) e.preventDefault(); });
  document.addEventListener("drop", (e) => {
    if (!carriesFile(e)) return;
    e.preventDefault(); // the browser would leave the page for the file
    depth = 0;
    show(false);
    const [file, ...more] = e.dataTransfer.files, zone = e.target.closest("[data-open]"), as = zone ? zone.dataset.open : may("played") ? "played" : "compared";
    if (!may(as)) return say("only who has the address with the token can open a recording here");
    if (more.length) return say("one recording at a time");
    send(file, as);
  });
  for (const [as, zone] of Object.entries(ZONES)) {
    byId(zone).querySelector("input").onchange = (e) => {
      if (e.target.files.length) send(e.target.files[0], as);
      e.target.value = "";
    };
  }
}
