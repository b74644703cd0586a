// An autopilot's parameters as the log begins, and every change of them.
import { $, make } from "./make.js";
import { look, offset, on, ready, say } from "./state.js";
import { choose } from "./marks.js";

const MOST = 300;
let word = "";

const digits = (value) => (value === null || value === undefined ? "–" : String(+Number(value).toPrecision(7)));
const called = (name) => name.toLowerCase().includes(word);

function changes(log) {
  const found = log.changes.filter((change) => called(change.name));
  if (!found.length) return [];
  const go = (change) => {
    choose(change.time + offset(log));
    look(change.time + offset(log) - 5, change.time + offset(log) + 5);
    say("marks");
  };
  return [
    make("h3", {}, `Changed in flight (${found.length})`),
    make("table", {}, make("thead", {}, make("tr", {}, make("th", { class: "number" }, "time [s]"), make("th", {}, "name"), make("th", { class: "number" }, "before"), make("th", { class: "number" }, "after"))),
      make("tbody", {}, ...found.map((change) => make("tr", { class: "go", onclick: () => go(change) },
        make("td", { class: "number" }, (change.time + offset(log)).toFixed(2)), make("td", {}, change.name),
        make("td", { class: "number" }, digits(change.before)), make("td", { class: "number" }, digits(change.value)))))),
  ];
}

function values(log) {
  const found = log.parameters.filter(([name]) => called(name));
  if (!log.parameters.length) return [make("p", { class: "soft" }, "This log holds no parameters.")];
  const more = found.length > MOST ? make("p", { class: "soft" }, `${found.length - MOST} more: search for them.`) : "";
  return [
    make("h3", {}, `At the beginning of the log (${found.length})`),
    make("table", {}, make("thead", {}, make("tr", {}, make("th", {}, "name"), make("th", { class: "number" }, "value"))),
      make("tbody", {}, ...found.slice(0, MOST).map(([name, value]) => make("tr", {}, make("td", {}, name), make("td", { class: "number" }, digits(value)))))),
    more,
  ];
}

function show() {
  const list = $("parameters").querySelector("div");
  list.replaceChildren(...ready().flatMap((log) => [make("h2", {}, log.name), ...changes(log), ...values(log)]));
}

export function begin() {
  const filter = make("input", { type: "search", class: "filter", placeholder: "Search parameters", "aria-label": "search parameters" });
  filter.oninput = () => {
    word = filter.value.toLowerCase();
    show();
  };
  $("parameters").append(filter, make("div"));
  on("logs", show);
  show();
}
