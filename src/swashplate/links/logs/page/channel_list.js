// Channels in groups, searched by name or meaning, ticked to be drawn.
import { $, make } from "./make.js";
import { channels, draw, drawn, erase, on } from "./state.js";

const OPEN = new Set(["Rates", "Attitude", "Commands"]);
let closed = new Set();

function row(channel) {
  const tick = make("input", { type: "checkbox", "data-channel": channel.name,
    onchange: (event) => (event.target.checked ? draw(channel.name) : erase(channel.name)) });
  tick.checked = drawn(channel.name);
  const facts = [channel.unit || "–", channel.rate ? `${channel.rate >= 10 ? channel.rate.toFixed(0) : channel.rate} Hz` : ""];
  return make("label", { title: channel.about }, tick, make("span", {}, channel.name), make("small", {}, facts.filter(Boolean).join(" · ")));
}

function show() {
  const words = $("search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const groups = new Map();
  for (const channel of channels().values()) {
    const text = `${channel.name} ${channel.about} ${channel.group} ${channel.unit}`.toLowerCase();
    if (!words.every((word) => text.includes(word))) continue;
    if (!groups.has(channel.group)) groups.set(channel.group, []);
    groups.get(channel.group).push(channel);
  }
  const boxes = [...groups].map(([title, list]) => {
    const box = make("details", { open: words.length > 0 || (OPEN.has(title) && !closed.has(title)) || list.some((c) => drawn(c.name)) },
      make("summary", {}, title, " ", make("small", {}, String(list.length))), ...list.map(row));
    box.addEventListener("toggle", () => !words.length && (box.open ? closed.delete(title) : closed.add(title)));
    return box;
  });
  const none = words.length ? "No channel is called that." : "";
  $("groups").replaceChildren(...(boxes.length ? boxes : [make("p", { class: "soft" }, none)]));
}

export function begin() {
  $("search").oninput = show;
  on("logs", show);
  on("charts", show);
}
