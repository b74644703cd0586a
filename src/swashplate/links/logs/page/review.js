// What a flight tells without a sweep: what happened, how its loops answer, what shakes it, and what to fly next.
import { note } from "./code.js";
import { clear, curves } from "./curve.js";
import { choose } from "./marks.js";
import { $, make } from "./make.js";
import { post } from "./server.js";
import { look, offset, on, ready, say } from "./state.js";
import { attempt } from "./trouble.js";
import { lines as copied } from "./code.js";
import { view } from "./views.js";

const kept = new Map(); // by log and version
const HEADS = ["rate loops", "filters", "noise", "what to fly next"];
let asking = "";
const open = () => document.body.dataset.view === "review";
const key = (log) => `${log.id} ${log.version}`;

function incident(log, one) {
  const go = () => {
    const wide = Math.max(2, one.stop - one.start);
    choose(one.start + offset(log));
    look(one.start - 0.5 * wide + offset(log), one.stop + 0.5 * wide + offset(log));
    if (matchMedia("(max-width: 900px)").matches) view("plots");
    say("marks");
  };
  return make("tr", { class: "go", tabindex: 0, onclick: go, onkeydown: (event) => event.key === "Enter" && go() },
    make("td", { class: "number" }, `${(one.start + offset(log)).toFixed(1)} s`), make("td", { class: "kind" }, make("b", {}, one.kind)), make("td", {}, one.text));
}

function loop(home, one) {
  if (!one.step) return;
  const { time, response, low, high } = one.step;
  curves(home, { title: `Step response, ${one.axis}`, x: time, xLabel: "time [s]", yLabel: "rate / target [1]", level: 1, lines: [
    { name: "95 % band", values: low, colour: 7, dash: [3, 3] }, { name: "", hidden: true, values: high, colour: 7, dash: [3, 3] }, { name: "response", values: response, colour: 0, dash: [] }] });
}

function noise(home, one) {
  if (one.frequency.length < 3) return;
  const level = (values) => values.map((value) => (value > 0 ? 10 * Math.log10(value) : null)), x = one.frequency.slice(1);
  curves(home, { title: `Noise of ${one.channel}`, x, xLabel: "frequency [Hz]", yLabel: "dB of (deg/s)²/Hz", lines: [
    { name: "before the filters", values: level(one.before.slice(1)), colour: 7, dash: [] }, { name: "behind them", values: level(one.after.slice(1)), colour: 0, dash: [] }] });
}

const list = (texts) => make("ul", { class: "plain" }, ...texts.map((text) => make("li", {}, text)));
const parameters = (found) => copied("Parameters", Object.entries(found).map(([name, value]) => `${name},${+(+value).toPrecision(6)}`).join("\n"));

function draw() {
  if (!open()) return;
  clear();
  const [log] = ready(), home = $("review"), found = log && kept.get(key(log));
  if (!log) return home.replaceChildren(make("p", { class: "soft" }, "Open a log, and what its flight tells stands here."));
  if (!found) return;
  if (found.problem) return home.replaceChildren(make("h2", {}, log.name), make("p", { class: "soft" }, found.problem));
  home.replaceChildren(make("h2", {}, `${log.name}${found.vehicle ? `: ${found.vehicle}` : ""}`));
  if (found.made_for) home.append(make("p", { class: "why", "data-made-for": "" }, found.made_for));
  home.append(make("h3", {}, "What happened"), found.incidents.length
    ? make("table", {}, make("tbody", {}, ...found.incidents.map((one) => incident(log, one))))
    : make("ul", { class: "cards" }, make("li", { class: "fine" }, "Nothing: no oscillation, saturation, strong vibration, clipping, loss of GPS or power, no gap.")));
  const told = new Map(found.lists);
  const of = (begin) => [...told].filter(([heading]) => heading.startsWith(begin)).flatMap(([, texts]) => texts);
  for (const head of HEADS) {
    const texts = of(head);
    if (!texts.length && head !== "rate loops") continue;
    const heading = [...told.keys()].find((one) => one.startsWith(head)) ?? head;
    home.append(make("h3", {}, heading.charAt(0).toUpperCase() + heading.slice(1)));
    if (head === "rate loops") for (const one of found.loops) loop(home, one);
    if (head === "noise") for (const one of found.noise) noise(home, one);
    home.append(texts.length ? list(texts) : make("p", { class: "soft" }, "The log has no rate with its target."));
    if (head === "noise") for (const text of new Set(found.noise.map((one) => JSON.stringify(one.parameters)))) if (text !== "{}") home.append(make("div", { class: "code" }, parameters(JSON.parse(text))));
    if (head === "what to fly next") for (const one of found.next) if (Object.keys(one.parameters).length) home.append(make("h3", {}, `${one.axis}: the autopilot's parameters`), make("div", { class: "code" }, parameters(one.parameters)));
  }
  home.dataset.drawn = key(log);
}

const fetchReview = attempt(async () => {
  const [log] = ready();
  if (!open() || !log) return draw();
  if (!log.checked) return $("review").replaceChildren(make("p", { class: "soft" }, "The log is being checked …"));
  if (kept.has(key(log)) || asking === key(log)) return draw();
  asking = key(log);
  $("review").replaceChildren(make("h2", {}, log.name), make("p", { class: "soft" }, "looking at loops, noise and incidents …"));
  try {
    const found = await post("/review", { log: log.id });
    kept.set(asking, found);
    note(found.code);
  } catch (error) {
    kept.set(asking, { problem: error.words ?? String(error) });
  } finally {
    asking = "";
  }
  draw();
});

export function begin() {
  on("view", (name) => (name === "review" ? fetchReview() : null));
  on("logs", fetchReview);
  on("theme", draw);
  on("offset", draw);
}
