// The connection to the monitor. It comes back by itself; commands carry the token of the address.
import { store, receive, describe, connectedAnew } from "./store.js";

export const token = new URLSearchParams(location.hash.slice(1)).get("token");
let socket = null;

export function send(command, more = {}) {
  if (token && socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ command, token, ...more }));
}
// Says that somebody looks: silent viewers make room for others.
setInterval(() => {
  if (!document.hidden && socket && socket.readyState === WebSocket.OPEN) socket.send('{"here":true}');
}, 15000);
/** `on`: {stream, status, log(lines, all)} are called when such a message has come. */
export function connect(on) {
  socket = new WebSocket(`ws://${location.host}/stream${token ? `?token=${token}` : ""}`);
  socket.binaryType = "arraybuffer";
  socket.onopen = connectedAnew;
  socket.onclose = () => {
    store.connected = false;
    setTimeout(connect, 1000, on);
  };
  socket.onmessage = (event) => {
    if (typeof event.data !== "string") {
      if (store.stream) receive(event.data);
      return;
    }
    const message = JSON.parse(event.data);
    if (message.type === "stream") { describe(message); on.stream(message); }
    if (message.type === "history") on.log(message.log, true);
    if (message.type === "status") { store.status = message; on.status(message); on.log(message.log, false); }
    if (message.type === "client") store.dropped = message.dropped;
    if (message.type === "refused") on.log(["refused: " + message.reason], false);
  };
}
