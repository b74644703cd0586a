// The stack of charts on one axis of time: asked for anew, thinned by the server, at every zoom.
import { note } from "./code.js";
import { Chart } from "./chart.js";
import { gestures } from "./gestures.js";
import { $ } from "./make.js";
import { attempt } from "./trouble.js";
import { post } from "./server.js";
import { charts, logs, look, offset, on, ready, seen, whole } from "./state.js";

let made = [], asked = 0, timer = 0;

const fetchAll = attempt(async () => {
  const number = ++asked;
  const wanted = made.flatMap((chart) => chart.wanted());
  if (!wanted.length) return;
  const bins = Math.max(200, Math.min(2000, Math.round(made[0].plot.width * devicePixelRatio)));
  let traces;
  try {
    ({ traces } = await post("/traces", { wanted, bins }));
  } catch (error) {
    if (number === asked) throw error; // else it was of a log that has been closed meanwhile
  }
  if (number !== asked || wanted.some(([log]) => !logs.has(log))) return; // meanwhile zoomed again, or a log was closed
  let at = 0;
  for (const chart of made) {
    chart.fill(traces.slice(at, at + chart.series.length));
    at += chart.series.length;
  }
  document.documentElement.dataset.drawn = String(number);
  const first = ready()[0], names = wanted.map(([log, name]) => [log, name]);
  const span = first && (seen.low !== whole()[0] || seen.high !== whole()[1]) ? [[seen.low - offset(first), seen.high - offset(first)]] : [];
  note(await post("/plot-code", { wanted: names, span }));
});

function soon(wait = 60) {
  clearTimeout(timer);
  timer = setTimeout(fetchAll, wait);
}

function tell() {
  const digits = seen.high - seen.low > 100 ? 1 : seen.high - seen.low > 1 ? 2 : 4;
  $("span").textContent = ready().length ? `${seen.low.toFixed(digits)} to ${seen.high.toFixed(digits)} s` : "";
}

function show() {
  made.forEach((chart) => chart.close());
  made = charts.map((spec, i) => new Chart($("charts"), spec, i === 0));
  for (const chart of made) gestures(chart.plot);
  $("tools").hidden = !ready().length;
  $("empty").hidden = logs.size > 0;
  tell();
  soon(0);
}

function move() {
  made.forEach((chart) => chart.rescale());
  tell();
  soon();
}

export function all() {
  look(...whole());
}

const DOES = {
  all,
  back: () => seen.past.length && look(...seen.past.pop(), { remember: false }),
  left: () => look(seen.low - 0.3 * (seen.high - seen.low), seen.high - 0.3 * (seen.high - seen.low)),
  right: () => look(seen.low + 0.3 * (seen.high - seen.low), seen.high + 0.3 * (seen.high - seen.low)),
  in: () => look(seen.low + 0.25 * (seen.high - seen.low), seen.high - 0.25 * (seen.high - seen.low)),
  out: () => look(seen.low - 0.5 * (seen.high - seen.low), seen.high + 0.5 * (seen.high - seen.low)),
  clear: () => {
    charts.length = 0;
    show();
  },
};

export function begin() {
  for (const button of document.querySelectorAll("[data-do]")) button.onclick = DOES[button.dataset.do];
  on("charts", show);
  on("theme", show);
  on("offset", move);
  on("seen", move);
  on("marks", () => made.forEach((chart) => chart.plot.redraw(false, true)));
  new ResizeObserver(() => made.forEach((chart) => chart.resize())).observe($("charts"));
}
