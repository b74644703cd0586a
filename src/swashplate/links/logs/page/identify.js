// From a sweep to gains: one click begins, the rest is watched, read and taken away.
import { note } from "./code.js";
import { clear } from "./curve.js";
import { $, make } from "./make.js";
import { result } from "./result.js";
import { get, post } from "./server.js";
import { channels, on, ready } from "./state.js";
import { attempt } from "./trouble.js";
import { view } from "./views.js";

const NO_SWEEP = "No sweep was found. A sweep is a command whose frequency rises steadily; swash maneuver designs one.";
let last = null, running = false, chosen = null;

export const begin_with = attempt(async (log, sweep, input = "", output = "") => {
  view("identify");
  const begun = await post("/identify", { log: log.id, sweep: sweep.number, input, output });
  chosen = { log, sweep, ...begun.channels };
  last = { state: "running", doing: "starting", share: 0, seconds: 0 };
  if (!running) watch();
  show();
});

const watch = attempt(async () => {
  running = true;
  try {
    for (;;) {
      last = await get("/job");
      if (last.state !== "running") break;
      progress();
      await new Promise((done) => setTimeout(done, 350));
    }
  } finally {
    running = false;
  }
  if (last.state === "done") note(last.result.code);
  show();
});

const cancel = attempt(async () => {
  await post("/cancel", {});
});

function progress() {
  const box = $("identify").querySelector(".progress");
  if (!box) return show();
  box.querySelector("progress").value = last.share ?? 0;
  box.querySelector("span").textContent = `${last.doing}, ${Math.round(last.seconds ?? 0)} s`;
}

// Sweeps of several inputs are estimated together, whichever of them is asked for.
const several = () => new Set(ready().flatMap((log) => log.sweeps.map((sweep) => sweep.axis))).size > 1;
const label = (sweep) => `${sweep.axis}, ${+sweep.low.toPrecision(3)} to ${+sweep.high.toPrecision(3)} Hz`;

const begin_button = (log, sweep, words) => make("button", { class: "first", "data-identify": `${log.id} ${sweep.number}`, disabled: last?.state === "running", onclick: () => begin_with(log, sweep) }, words);

function list() {
  const all = ready().flatMap((log) => log.sweeps.map((sweep) => [log, sweep])), together = several();
  if (!all.length) return make("div", {}, make("p", { class: "soft" }, ready().some((log) => !log.checked) ? "Sweeps are being looked for …" : NO_SWEEP), make("button", { onclick: () => view("review") }, "What the flight tells without one"));
  const rows = all.map(([log, sweep]) => make("li", { class: "fine" }, make("b", {}, label(sweep)), make("div", { class: "soft" }, `${ready().length > 1 ? `${log.name}, ` : ""}${sweep.words.split(": ").slice(1).join(": ")}`), together ? "" : begin_button(log, sweep, "Identify this")));
  return make("div", {}, make("ul", { class: "cards" }, ...rows), together ? begin_button(...all[0], "Identify them together") : "");
}

// Other channels than those that the sweep's axis names.
function again() {
  if (!chosen || last?.state === "running") return [];
  const names = [...channels().values()].filter((channel) => !channel.raw && channel.logs.includes(chosen.log.id)).map((channel) => channel.name);
  const select = (now) => make("select", {}, ...names.map((name) => make("option", { value: name, selected: name === now }, name)));
  const input = select(chosen.input), output = select(chosen.output);
  return [make("details", { class: "notes" }, make("summary", {}, "Take other channels"), make("div", { class: "bar" },
    make("label", {}, "input ", input), make("label", {}, "output ", output),
    make("button", { onclick: () => begin_with(chosen.log, chosen.sweep, input.value, output.value) }, "Identify again")))];
}

function state() {
  if (!last || last.state === "none") return [];
  if (last.state === "running")
    return [make("div", { class: "progress" }, make("progress", { max: 1, value: last.share ?? 0 }), make("span", {}, last.doing ?? ""), make("button", { id: "cancel", onclick: cancel }, "Cancel"))];
  if (last.state === "cancelled") return [make("p", { class: "soft" }, "Cancelled. Nothing was kept.")];
  if (last.state === "failed") return [make("ul", { class: "cards" }, make("li", { role: "alert" }, make("b", {}, "It could not be identified: "), last.problem, make("div", { class: "soft" }, last.hint)))];
  return [];
}

function show() {
  clear();
  const home = $("identify");
  home.dataset.state = last?.state ?? "none";
  home.replaceChildren(make("h2", {}, "Identify a sweep"), list(), ...state(), ...again());
  if (last?.state === "done" && document.body.dataset.view === "identify") result(home, last.result);
}

// Buttons above the plots, one for each sweep that is marked there.
function shortcuts() {
  const all = ready().flatMap((log) => log.sweeps.map((sweep) => [log, sweep]));
  const row = (words, log, sweep, verb) => make("div", { class: "sweep" }, make("span", {}, words), make("button", { class: "first", onclick: () => begin_with(log, sweep) }, verb));
  if (several()) $("sweeps").replaceChildren(row(`Sweeps ${all.map(([, sweep]) => label(sweep)).join("; ")}`, ...all[0], "Identify them together"));
  else $("sweeps").replaceChildren(...all.map(([log, sweep]) => row(`Sweep ${label(sweep)}${ready().length > 1 ? ` (${log.name})` : ""}`, log, sweep, "Identify this")));
}

export function begin() {
  on("logs", shortcuts);
  on("logs", show);
  on("view", (name) => name === "identify" && show());
  on("theme", show);
  let width = innerWidth; // a telephone that is turned; its height changes with every scroll
  addEventListener("resize", () => {
    if (width !== innerWidth) show();
    width = innerWidth;
  });
}
