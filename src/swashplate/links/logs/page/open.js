// The page for any log: its parts, and what is drawn when a log comes.
import * as channel_list from "./channel_list.js";
import * as code from "./code.js";
import * as columns from "./columns.js";
import * as drop from "./drop.js";
import * as events from "./events.js";
import * as findings from "./findings.js";
import * as gestures from "./gestures.js";
import * as identify from "./identify.js";
import * as log_list from "./log_list.js";
import * as map from "./map.js";
import * as parameters from "./parameters.js";
import * as plots from "./plots.js";
import * as review from "./review.js";
import { post } from "./server.js";
import * as spectrum from "./spectrum.js";
import * as start from "./start.js";
import * as state from "./state.js";
import * as theme from "./theme.js";
import * as track from "./track.js";
import * as trouble from "./trouble.js";
import * as views from "./views.js";

const LOOPS = { "Roll rate": ["p_demand", "p"], "Pitch rate": ["q_demand", "q"], "Yaw rate": ["r_demand", "r"] }; // of a log that tunes: target and actual
const FIRST = { Rates: 3, Attitude: 3, Commands: 4, Position: 3 }; // channels that are drawn unasked, by group
const MOST = 3; // charts of them
let known = "", answered = 0;

// What is drawn of a log that has just come: targets and what came of them, else rates, attitude and commands where it has
// them, else its first channels.
function greet() {
  document.body.toggleAttribute("data-logs", state.logs.size > 0);
  views.count();
  const now = [...state.logs.values()].map((log) => `${log.id}:${log.version}:${log.state}`).join(" ");
  if (now === known) return;
  const grown = state.ready().length && (known === "" || !state.charts.length);
  known = now;
  for (const log of state.ready()) code.note(log.code);
  const there = state.channels();
  for (const chart of state.charts) chart.channels = chart.channels.filter((name) => there.has(name));
  for (let i = state.charts.length - 1; i >= 0; i--) if (!state.charts[i].channels.length) state.charts.splice(i, 1);
  if (grown || !state.charts.length) {
    for (const [title, pair] of Object.entries(LOOPS)) if (pair.every((name) => there.has(name))) state.drawTogether(title, pair);
    for (const [title, count] of Object.entries(FIRST)) {
      if (state.charts.some((chart) => chart.title in LOOPS) && title !== "Attitude") continue;
      const of = [...there.values()].filter((channel) => channel.group === title && !/^q[wxyz]$/.test(channel.name));
      if (state.charts.length < MOST) for (const channel of of.slice(0, count)) state.draw(channel.name, true);
    }
    if (!state.charts.length) for (const name of [...there.keys()].slice(0, 3)) state.draw(name, true);
  }
  [state.seen.low, state.seen.high] = state.whole();
  state.say("charts");
}

// A flight without a sweep, whose loops the log tells of, is answered unasked; a person who has chosen a view keeps it.
function answer() {
  const [log] = state.ready();
  if (!log?.checked || answered === log.id) return;
  answered = log.id;
  const loops = Object.values(LOOPS).some((pair) => pair.every((name) => state.channels().has(name)));
  if (loops && !log.sweeps.length && document.body.dataset.view === "findings" && !matchMedia("(max-width: 900px)").matches) views.view("review");
}

for (const part of [trouble, code, views, channel_list, columns, log_list, plots, gestures, findings, events, parameters, spectrum, map, track, review, identify, drop, start]) part.begin();
state.on("logs", greet);
state.on("logs", answer);
theme.begin();
const told = await log_list.refresh();
if (told) {
  drop.allow(told);
  start.offer(told.examples);
}
state.say("charts");
window.swash = { state, post };
document.documentElement.dataset.ready = "yes";
