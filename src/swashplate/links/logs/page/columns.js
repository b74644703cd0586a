// Which column of a table is which channel: guesses to look at, change and keep. Curves are drawn in the chosen unit and sign.
import { note } from "./code.js";
import { refresh } from "./log_list.js";
import { $, make, shape, short } from "./make.js";
import { post } from "./server.js";
import { logs, on, say } from "./state.js";
import { attempt } from "./trouble.js";

let table = null, log = null, rows = [];
const asked = new Set(); // logs for which it was opened unasked

const inside = (name) => table.channels.find((one) => one.name === name)?.unit ?? "";
const fits = (channel) => (channel === "time" ? Object.keys(table.units).filter((name) => table.units[name][0] === "s") : Object.keys(table.units).filter((name) => table.units[name][0] === inside(channel)));
const shownUnit = (channel, unit) => (table.units[unit] && inside(channel).startsWith("rad") && !unit.startsWith("deg") ? inside(channel).replace("rad", "deg") : unit);

// Values of a column as the chosen unit makes them, in the unit of the screen.
function scaled(row) {
  const known = table.units[row.unit], [, own] = known ?? ["", 1], to = shownUnit(row.channel, row.unit), [, screen] = table.units[to] ?? ["", 1];
  return row.values.map((value) => (value === null ? null : ((value * row.factor + row.offset) * own) / (known ? screen : 1)));
}

function spark(row) {
  const values = scaled(row), there = values.filter((value) => value !== null && Number.isFinite(value));
  if (!there.length) return make("span", { class: "soft" }, row.first.join(", ") || "blank");
  const low = Math.min(...there), high = Math.max(...there), span = high - low || 1;
  const points = values.map((value, k) => (value === null ? "" : `${((200 * k) / Math.max(1, values.length - 1)).toFixed(1)},${(31 - (30 * (value - low)) / span).toFixed(1)}`)).filter(Boolean).join(" ");
  return make("div", { class: "spark" }, shape("svg", { viewBox: "0 0 200 32", preserveAspectRatio: "none", "aria-hidden": "true" }, shape("polyline", { points })),
    make("small", {}, `${short(low)} to ${short(high)} ${row.channel && row.channel !== "time" ? shownUnit(row.channel, row.unit) : ""}`));
}

function line(row) {
  const curve = make("td", { class: "curve" }), why = make("small", { class: "soft" }, row.why ?? "");
  const unit = make("select", { "aria-label": `unit of ${row.label}`, onchange: () => ((row.unit = unit.value), draw()) });
  const turned = make("input", { type: "checkbox", "aria-label": `turn the sign of ${row.label}`, checked: row.factor < 0, onchange: () => ((row.factor = -row.factor), (row.offset = -row.offset), draw()) });
  const channel = make("input", { list: "channel-names", value: row.channel, placeholder: "not read", spellcheck: "false", "aria-label": `channel of ${row.label}`, oninput: () => {
    row.channel = channel.value.trim();
    offer();
    draw();
  } });
  const offer = () => {
    const known = row.channel ? fits(row.channel) : [], list = known.length ? known : row.unit ? [row.unit] : [];
    if (known.length && !known.includes(row.unit)) row.unit = known.includes(row.said) ? row.said : row.channel === "time" ? "" : known[0];
    unit.replaceChildren(...["", ...list.filter(Boolean)].map((name) => make("option", { value: name, selected: name === row.unit }, name || "–")));
    turned.disabled = !row.channel || row.channel === "time";
  };
  const draw = () => {
    curve.replaceChildren(spark(row));
    tr.classList.toggle("chosen", Boolean(row.channel));
  };
  const tr = make("tr", { "data-column": row.label }, make("td", {}, make("b", {}, row.label), make("br"), why), curve, make("td", {}, channel), make("td", {}, unit), make("td", { class: "number" }, make("label", { title: "turn the sign" }, turned, " −")));
  offer();
  draw();
  return tr;
}

function faults(list) {
  $("columns").querySelector(".faults").replaceChildren(...(list.length ? [make("ul", { class: "cards" }, ...list.map((text) => make("li", { role: "alert" }, text)))] : []));
}

const apply = attempt(async () => {
  const rate = table.timed || rows.some((row) => row.channel === "time") ? 0 : Number($("columns").querySelector("[name=rate]")?.value || 0);
  const wanted = rows.filter((row) => row.channel).map((row) => [row.index, row.channel, row.unit, row.factor, row.offset]);
  const told = await post("/map-columns", { log: log.id, rows: wanted, rate });
  faults(told.faults);
  if (told.faults.length) return;
  $("columns").close();
  await refresh();
  const now = logs.get(log.id);
  if (now?.code) note(now.code);
  $("state").textContent = "The mapping is kept: the next log with these columns opens by itself.";
});

export const show = attempt(async (of) => {
  log = of;
  table = await post("/columns", { log: of.id });
  rows = table.columns.map((column) => ({ ...column, said: column.unit, label: column.name || `column ${column.index + 1}` }));
  const rate = table.timed ? [] : [make("p", {}, make("label", {}, "No column is the time. Samples a second: ", make("input", { name: "rate", type: "number", min: "0", step: "any", value: table.rate ?? 100 })))];
  const home = $("columns");
  home.replaceChildren(
    make("h2", {}, `Columns of ${of.name}`),
    make("p", { class: "soft" }, `${table.rows} rows. Say what each column is; a blank channel is not read. Angles are drawn in degrees. The mapping is kept, and the next log with these columns opens by itself.`),
    make("div", { class: "faults" }), ...rate,
    make("datalist", { id: "channel-names" }, make("option", { value: "time" }), ...table.channels.map((one) => make("option", { value: one.name }, one.about))),
    make("div", { class: "scroll" }, make("table", {}, make("thead", {}, make("tr", {}, ...["column", "curve", "channel", "unit", "sign"].map((name) => make("th", {}, name)))), make("tbody", {}, ...rows.map(line)))),
    make("div", { class: "bar" }, make("button", { class: "first", id: "map-apply", onclick: apply }, "Read it so"), make("button", { onclick: () => home.close() }, "Cancel")),
  );
  if (table.problem) faults([table.problem]);
  if (!home.open) home.showModal();
});

export function begin() {
  on("columns", show);
  on("logs", () => {
    const stranger = [...logs.values()].find((one) => one.foreign && !asked.has(`${one.id} ${one.version}`));
    if (!stranger || $("columns").open) return;
    asked.add(`${stranger.id} ${stranger.version}`);
    show(stranger);
  });
}
