// What is wrong with each log, with a button for each remedy that is an option of its reading.
import { note } from "./code.js";
import { $, make } from "./make.js";
import { post } from "./server.js";
import { logs, on, say } from "./state.js";
import { attempt } from "./trouble.js";
import { refresh } from "./log_list.js";

const apply = attempt(async (log, remedy) => {
  const { words, ...options } = remedy;
  $("state").textContent = `reading ${log.name} with ${words} …`;
  const read = await post("/apply", { log: log.id, ...options });
  note(read.code);
  $("state").textContent = read.state === "ready" ? `${log.name} was read with ${words}.` : "";
  await refresh();
});

const button = (log, remedy) =>
  remedy && make("div", {}, make("button", { class: "first", "data-remedy": remedy.words, onclick: () => apply(log, remedy) }, "Read again with ", make("code", {}, remedy.words)));

function about(log) {
  const title = make("h2", {}, log.name);
  if (log.state === "reading") return [title, make("p", { class: "soft" }, "It is being read …")];
  if (log.state === "failed")
    return [title, make("ul", { class: "cards" }, make("li", { role: "alert" }, make("b", {}, "It cannot be read: "), log.problem, make("div", { class: "soft" }, log.hint), button(log, log.remedy),
      log.foreign && make("div", {}, make("button", { class: "first", onclick: () => say("columns", log) }, "Say what its columns are"))))];
  if (!log.checked) return [title, make("p", { class: "soft" }, "It is being checked: gaps, jumps, signs, units and sweeps. Look at the plots meanwhile …")];
  const problems = log.problems.length
    ? log.problems.map((problem) => make("li", {}, problem.text, button(log, problem.remedy)))
    : [make("li", { class: "fine" }, "Nothing was found wrong: no gaps, no jumps, and the channels do not contradict each other.")];
  const sweeps = log.sweeps.map((sweep) => make("li", { class: "fine" }, "Sweep ", sweep.words));
  const notes = log.notes.length && make("details", { class: "notes" }, make("summary", {}, `Notes of the reader (${log.notes.length})`),
    make("ul", {}, ...log.notes.map((text) => make("li", {}, text))));
  const with_ = log.options && make("p", { class: "soft" }, "Read with ", make("code", {}, log.options));
  return [title, with_, make("ul", { class: "cards" }, ...problems, ...sweeps), notes];
}

function show() {
  const list = [...logs.values()];
  $("findings").replaceChildren(
    ...(list.length ? list.flatMap(about).filter(Boolean) : [make("p", { class: "soft" }, "Open a log, and what is wrong with it stands here.")]),
  );
}

export function begin() {
  on("logs", show);
  show();
}
