// The logs on the page: name, length, vehicle, and the seconds that each is shifted by.
import { note } from "./code.js";
import { $, DASHES, ink, make, sample } from "./make.js";
import { answered, get, post } from "./server.js";
import { logs, offset, offsets, on, ready, say } from "./state.js";
import { attempt, trouble } from "./trouble.js";

const entries = new Map(); // by log, what the list shows of it
const leaving = new Set(); // closed here, not yet by the server
let timer = 0;

function shift(log, seconds) {
  if (!Number.isFinite(seconds)) return;
  offsets.set(log.id, seconds);
  show();
  say("offset");
}

const align = attempt(async (log) => {
  const [first] = ready();
  const found = await post("/align", { first: first.id, second: log.id });
  note(found.code);
  $("state").textContent = found.words;
  shift(log, found.offset + offset(first));
});

function clock(log) {
  const seconds = make("input", { type: "number", step: "0.01", "aria-label": `offset of ${log.name} in seconds`,
    onchange: (event) => shift(log, event.target.valueAsNumber) });
  return make("div", { class: "offset" }, make("label", {}, "shifted by ", seconds, " s"),
    make("button", { onclick: () => align(log), title: "match the motion that both have seen" }, "Align by motion"));
}

function facts(log) {
  if (log.state === "reading") return make("small", {}, "reading …");
  if (log.state === "failed") return make("small", { class: "failed" }, log.problem);
  const words = [log.checked ? "" : "being checked …", `${(log.stop - log.start).toFixed(1)} s`, log.vehicle, log.reader, log.simulated ? "simulated" : "", log.options];
  return make("small", {}, words.filter(Boolean).join(" · "));
}

function entry(log) {
  const off = make("button", { "aria-label": `close ${log.name}`, title: "close this log", onclick: () => close(log) }, "✕");
  const line = document.createTextNode(""), told = make("small"), name = make("div", { class: "name" }, line, make("span", {}, ...log.name.split(/(?<=[_.@-])/).flatMap((part) => [part, make("wbr")])), off);
  const columns = make("button", { class: "columns", "aria-label": `columns of ${log.name}`, onclick: () => say("columns", logs.get(log.id)) }, "Columns …");
  return { item: make("li", { "data-log": log.id }, name, told), clock: clock(log), columns, line, told };
}

// What is on the page stays there and is changed: the list is shown anew while logs are read, and someone may be typing in it.
function show() {
  const order = ready().map((log) => log.id);
  for (const [id, { item }] of entries) if (!logs.has(id)) item.remove(), entries.delete(id);
  for (const log of logs.values()) {
    if (!entries.has(log.id)) entries.set(log.id, entry(log));
    const kept = entries.get(log.id), { item, clock } = kept, k = order.indexOf(log.id), box = clock.querySelector("input");
    const now = { line: k >= 0 ? sample(ink("ink"), DASHES[k % DASHES.length]) : document.createTextNode(""), told: facts(log) };
    for (const part in now) kept[part].replaceWith(now[part]), (kept[part] = now[part]);
    if (box !== document.activeElement) box.value = +offset(log).toFixed(4);
    if (k > 0 !== clock.isConnected) k > 0 ? item.append(clock) : clock.remove();
    if (Boolean(log.table) !== kept.columns.isConnected) log.table ? item.append(kept.columns) : kept.columns.remove();
    if (!item.isConnected) $("logs").append(item);
  }
}

// It goes at once, so that nothing more is asked of it, and what has been asked is answered first; the first of those
// that stay is on its own clock.
const close = attempt(async (log) => {
  leaving.add(log.id);
  logs.delete(log.id);
  const [first] = ready(), ahead = first ? offset(first) : 0;
  for (const other of ready()) offsets.set(other.id, offset(other) - ahead);
  show();
  say("logs");
  await answered();
  try {
    await post("/close", { log: log.id });
  } finally {
    leaving.delete(log.id);
  }
  await refresh();
});

// Where a new log begins in shown time: on its own clock with the first one where both know the date, else together.
function place(log) {
  const [first] = ready();
  if (!first || first.id === log.id || offsets.has(log.id)) return;
  const dated = log.epoch && first.epoch ? log.epoch - first.epoch : null;
  const together = dated !== null && log.start + dated < first.stop && log.stop + dated > first.start;
  offsets.set(log.id, offset(first) + (together ? dated : first.start - log.start));
}

// Asks until every log is read; says "logs" where something has changed.
export const refresh = attempt(async () => {
  clearTimeout(timer);
  const told = await get("/logs");
  const before = JSON.stringify([...logs.values()].map((log) => [log.id, log.version, log.state, log.checked, log.listed]));
  logs.clear();
  for (const log of told.logs) if (!leaving.has(log.id)) logs.set(log.id, log);
  for (const log of ready()) place(log);
  $("largest").textContent = Math.floor(told.largest / 1e6);
  if (told.logs.some((log) => log.state === "reading" || log.checked === false)) timer = setTimeout(refresh, 400);
  const now = JSON.stringify([...logs.values()].map((log) => [log.id, log.version, log.state, log.checked, log.listed]));
  show();
  if (now !== before) say("logs");
  if (ready().length > 1) {
    const { words } = await post("/common", { numbers: ready().map((log) => log.id) });
    if (words) trouble({ words });
  }
  return told;
});

export function begin() {
  on("theme", show);
}
