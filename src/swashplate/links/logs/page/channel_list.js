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
    const raw = list[0].raw, open = words.length > 0 || (OPEN.has(title) && !closed.has(title)) || list.some((c) => drawn(c.name));
    const box = make("details", { open }, make("summary", {}, title, " ", make("small", {}, String(list.length))), ...(open ? list.map(row) : []));
    box.addEventListener("toggle", () => {
      if (box.open && box.children.length === 1) box.append(...list.map(row)); // hundreds of fields: only those that are looked at
      if (!words.length) box.open ? closed.delete(title) : closed.add(title);
    });
    return { raw, box };
  });
  const none = words.length ? "Nothing in the log is called that." : "";
  const known = boxes.filter(({ raw }) => !raw), fields = boxes.filter(({ raw }) => raw);
  const heading = fields.length ? [make("h3", {}, "Every message of the log")] : [];
  $("groups").replaceChildren(...(boxes.length ? [...known.map(({ box }) => box), ...heading, ...fields.map(({ box }) => box)] : [make("p", { class: "soft" }, none)]));
}

export function begin() {
  $("search").oninput = show;
  on("logs", show);
  on("charts", show);
}
