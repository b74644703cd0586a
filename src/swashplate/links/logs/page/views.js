// Which view is seen: on a desk the one at the right, on a telephone the only one.
import { $, make } from "./make.js";
import { ready, say } from "./state.js";

const VIEWS = [
  ["channels", "Channels"], ["plots", "Plots"], ["review", "Flight"], ["findings", "Findings"], ["events", "Events"], ["parameters", "Parameters"],
  ["spectrum", "Spectrum"], ["map", "Map"], ["track", "3-D"], ["identify", "Identify"], ["code", "Code"],
];

export function view(name) {
  document.body.dataset.view = name;
  for (const button of $("views").children) button.setAttribute("aria-pressed", button.dataset.view === name);
  say("view", name);
}

export function begin() {
  $("views").replaceChildren(
    ...VIEWS.map(([name, title]) => make("button", { "data-view": name, onclick: () => view(name) }, title)),
  );
  view(matchMedia("(max-width: 900px)").matches ? "plots" : "findings");
}

// How many problems there are stands beside the word.
export function count() {
  const problems = ready().reduce((sum, log) => sum + log.problems.length, 0);
  const button = $("views").querySelector("[data-view=findings]");
  button.replaceChildren("Findings ", problems ? make("span", { class: "count" }, String(problems)) : "");
}
