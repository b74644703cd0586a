// What the logs say happened: modes, messages, arming; a click shows the place in the plots.
import { $, make } from "./make.js";
import { look, offset, on, ready, say } from "./state.js";
import { choose } from "./marks.js";
import { view } from "./views.js";

const AROUND = 5; // s on each side
let word = "";

function go(time) {
  choose(time);
  look(time - AROUND, time + AROUND);
  if (matchMedia("(max-width: 900px)").matches) view("plots");
  say("marks");
}

function rows(log) {
  const found = log.events.filter((event) => `${event.kind} ${event.text}`.toLowerCase().includes(word));
  const line = (event) =>
    make("tr", { class: "go", tabindex: 0, onclick: () => go(event.time + offset(log)), onkeydown: (key) => key.key === "Enter" && go(event.time + offset(log)) },
      make("td", { class: "number" }, `${(event.time + offset(log)).toFixed(2)}`), make("td", {}, event.kind), make("td", {}, event.text));
  return [
    make("h2", {}, log.name),
    found.length
      ? make("table", {}, make("thead", {}, make("tr", {}, make("th", { class: "number" }, "time [s]"), make("th", {}, "kind"), make("th", {}, "what"))),
        make("tbody", {}, ...found.map(line)))
      : make("p", { class: "soft" }, log.events.length ? "None of its events is called that." : "This log tells of no event."),
  ];
}

function show() {
  const list = $("events").querySelector("div");
  list.replaceChildren(...ready().flatMap(rows));
}

export function begin() {
  const filter = make("input", { type: "search", class: "filter", placeholder: "Search events", "aria-label": "search events" });
  filter.oninput = () => {
    word = filter.value.toLowerCase();
    show();
  };
  $("events").append(filter, make("div"));
  on("logs", show);
  on("offset", show);
  show();
}
