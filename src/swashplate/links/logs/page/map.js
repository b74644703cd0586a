// Where the flight was, from above, north up, coloured by mode; a place is a time in the plots.
import { note } from "./code.js";
import { choose, measured } from "./marks.js";
import { $, colour, ink, make, sample, shape } from "./make.js";
import { post } from "./server.js";
import { offset, on, ready, say } from "./state.js";
import { attempt } from "./trouble.js";

const SIDE = 400, EDGE = 26; // of the drawing
let found = null, of = "", asking = false;
const open = () => document.body.dataset.view === "map";

const nice = (length) => {
  const power = 10 ** Math.floor(Math.log10(length));
  return [5, 2, 1].map((k) => k * power).find((k) => k <= length);
};

function frame() {
  const [north, east] = [found.north, found.east];
  const middle = (v) => (Math.min(...v) + Math.max(...v)) / 2, spread = (v) => Math.max(...v) - Math.min(...v);
  const span = Math.max(spread(north), spread(east), 0.5), scale = (SIDE - 2 * EDGE) / span, [n0, e0] = [middle(north), middle(east)];
  return { span, scale, at: (k) => [SIDE / 2 + (east[k] - e0) * scale, SIDE / 2 - (north[k] - n0) * scale] };
}

const index = (time) => {
  let best = 0;
  found.time.forEach((t, k) => Math.abs(t - time) < Math.abs(found.time[best] - time) && (best = k));
  return best;
};

function pieces(log) {
  const modes = log.modes.length ? log.modes : [{ start: -Infinity, stop: Infinity, text: "" }], names = [...new Set(modes.map((mode) => mode.text))];
  const cut = [];
  found.time.forEach((t, k) => {
    const mode = modes.findLast((one) => one.start <= t) ?? modes[0], tint = names.indexOf(mode.text);
    if (cut.at(-1)?.tint !== tint) cut.push({ tint, places: cut.length ? [k - 1, k] : [k] });
    else cut.at(-1).places.push(k);
  });
  return { names, cut };
}

function draw() {
  if (!open()) return;
  const [log] = ready(), home = $("map");
  if (!log || !found) return;
  if (found.problem) {
    home.replaceChildren(make("h2", {}, "Map"), make("p", { class: "soft" }, found.problem));
    return;
  }
  const { span, scale, at } = frame(), { names, cut } = pieces(log), bar = nice(span / 3);
  const lines = cut.map(({ tint, places }) => shape("polyline", { points: places.map((k) => at(k).map((v) => v.toFixed(1)).join(",")).join(" "), fill: "none", stroke: colour(tint), "stroke-width": 2, "stroke-linejoin": "round" }));
  const dot = (k, fill, size) => shape("circle", { cx: at(k)[0], cy: at(k)[1], r: size, fill, stroke: ink("card"), "stroke-width": 1.5 });
  const now = measured() === null ? [] : [dot(index(measured() - offset(log)), ink("red"), 6)];
  const picture = shape("svg", { class: "places", viewBox: `0 0 ${SIDE} ${SIDE}`, role: "img", "aria-label": "track from above" }, ...lines, dot(0, ink("green"), 5), dot(found.time.length - 1, ink("ink"), 4), ...now,
    shape("path", { d: `M ${EDGE} ${SIDE - 10} h ${bar * scale}`, stroke: ink("soft"), "stroke-width": 2 }), shape("text", { x: EDGE + bar * scale + 6, y: SIDE - 6 }, bar >= 1000 ? `${bar / 1000} km` : `${bar} m`),
    shape("path", { d: `M ${SIDE - 18} 30 v -18 m -4 5 l 4 -6 l 4 6`, stroke: ink("soft"), fill: "none", "stroke-width": 1.5 }), shape("text", { x: SIDE - 22, y: 44 }, "N"));
  picture.addEventListener("pointerdown", (event) => {
    const box = picture.getBoundingClientRect(), x = ((event.clientX - box.left) / box.width) * SIDE, y = ((event.clientY - box.top) / box.height) * SIDE;
    let best = 0, least = Infinity;
    found.time.forEach((_, k) => {
      const [a, b] = at(k), far = (a - x) ** 2 + (b - y) ** 2;
      if (far < least) [best, least] = [k, far];
    });
    choose(found.time[best] + offset(log));
    say("marks");
  });
  const keys = names.filter(Boolean).map((name) => make("span", {}, sample(colour(names.indexOf(name))), name));
  home.replaceChildren(make("h2", {}, "Map"), picture, make("div", { class: "modes" }, ...keys),
    make("p", { class: "soft" }, `${found.words} Green: begin. A click shows its time in the plots${measured() === null ? "." : `: ${measured().toFixed(2)} s.`}`));
  home.dataset.drawn = String(found.time.length);
}

const fetchMap = attempt(async () => {
  const [log] = ready();
  if (!open() || !log || asking) return;
  const key = `${log.id} ${log.version} ${log.listed}`;
  if (of === key) return draw();
  asking = true;
  $("map").replaceChildren(make("h2", {}, "Map"), make("p", { class: "soft" }, "asking for the track …"));
  try {
    found = await post("/map", { log: log.id });
    note(found.code);
  } catch (error) {
    found = { problem: error.words ?? String(error) };
  } finally {
    asking = false;
    of = key;
  }
  draw();
});

export function begin() {
  on("view", fetchMap);
  on("logs", fetchMap);
  on("theme", draw);
  on("marks", draw);
}
