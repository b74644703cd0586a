// What came of a sweep: gains first, then what they rest on: answers in time, verification, fit, frequency response.
import { block } from "./code.js";
import { curves } from "./curve.js";
import { make, short } from "./make.js";

// A number with its bound: as many decimals as the bound has with one digit.
function pm([value, sigma]) {
  if (value === null) return "–";
  if (!sigma) return short(value);
  const decimals = Math.max(0, Math.min(6, -Math.floor(Math.log10(sigma))));
  return `${value.toFixed(decimals)} ± ${sigma.toFixed(decimals)}`.replaceAll(" ", "\u00a0"); // on one line, on a telephone too
}

const percent = (answer) => make("td", { class: "number" }, answer ? (answer.stable ? `${(100 * answer.overshoot).toFixed(0)} %` : "unstable") : "–");
const overshoot = (axis) => make("tr", {}, make("td", {}, "overshoot of a step"), percent(axis.before), percent(axis.after));

function gains(home, found) {
  for (const axis of found.gains) {
    const head = make("tr", {}, make("th", {}, "parameter"), make("th", { class: "number" }, "flown"), make("th", { class: "number" }, "suggested"));
    const number = (value) => make("td", { class: "number" }, value === null ? "–" : String(+(+value).toPrecision(4)));
    const rows = axis.rows.map(([name, flown, suggested]) => make("tr", {}, make("td", {}, name), number(flown), make("td", { class: "number" }, make("b", {}, suggested === null ? "–" : String(+(+suggested).toPrecision(4))))));
    const read = (value) => (value === undefined || value === null ? "–" : typeof value === "number" ? short(value) : pm(value)); // null: there is none
    const margin = (name, key) => make("tr", {}, make("td", {}, name), ...["before", "after"].map((when) => make("td", { class: "number" }, read(axis[when]?.[key]))));
    home.append(make("table", { class: "gains" }, make("thead", {}, head), make("tbody", {}, ...rows,
      margin("phase margin [deg]", "phase_margin"), margin("gain margin [dB]", "gain_margin"), margin("delay margin [ms]", "delay_margin"), margin("crossover [rad/s]", "crossover"), margin("largest sensitivity", "peak"), margin("bandwidth [rad/s]", "bandwidth"), margin("disturbance rejection [rad/s]", "rejection"), overshoot(axis))));
    home.append(make("p", {}, axis.words));
    answers(home, axis, found);
  }
  if (found.no_gains) home.append(make("p", { class: "warn", role: "alert", "data-no-gains": "" }, `No gains. ${found.no_gains}`));
}

function answers(home, axis, found) {
  const those = [["before", "as flown", 7, [6, 4]], ["after", "suggested", 0, []]].filter(([when]) => axis[when]);
  if (!those.length) return;
  if (axis.after && !axis.after.stable) home.append(make("p", { class: "warn", role: "alert" }, "The suggested gains are unstable on this model. Do not fly them."));
  if (axis.before && !axis.before.stable) home.append(make("p", { class: "warn", role: "alert" }, "On this model the flown gains do not settle, and the aircraft flew with them: do not trust the model."));
  const x = axis[those[0][0]].time;
  const lines = (key) => those.map(([when, name, tint, dash]) => ({ name, values: axis[when][key], colour: tint, dash }));
  curves(home, { title: "Step of the target", x, xLabel: "time [s]", yLabel: "rate / target [1]", lines: lines("step"), level: 1 });
  curves(home, { title: "Disturbance: 0.1 of the command", x, xLabel: "time [s]", yLabel: `${found.output} [deg/s]`, lines: lines("disturbance") });
  home.append(make("p", { class: "soft" }, "The loop is closed on the model at 400 Hz. The target steps at once; ArduPilot's own shaping of the target is not in it."));
}

function verification(home, found) {
  const seen = found.verification;
  home.append(make("h3", {}, "In time"));
  if (!seen) {
    home.append(make("p", { class: "soft" }, "This transfer function has no states, so it cannot be flown along a record."));
    return;
  }
  home.append(make("p", { class: seen.unseen ? "" : "warn" }, `Flown along ${seen.on}`));
  curves(home, { title: `${found.output}, flight and model`, x: seen.time, xLabel: "time [s]", yLabel: `${found.output} [${seen.unit}]`, lines: [
    { name: "flight", values: seen.flight, colour: 7, dash: [] }, { name: "model", values: seen.model, colour: 1, dash: [] }] });
  home.append(make("ul", { class: "plain" }, ...(seen.unseen ? seen.headline : seen.headline.slice(1)).map((text) => make("li", {}, text)), ...seen.warnings.filter((text) => seen.unseen || !text.startsWith("NOT A HOLD-OUT")).map((text) => make("li", { class: "warn" }, text))));
}

function bode(home, found) {
  const { bode: b } = found, x = b.frequency, label = "frequency [Hz]";
  const pair = (measured, fitted) => [{ name: "measured", values: measured, colour: 0, points: true }, { name: "model", values: fitted, colour: 1, dash: [] }];
  home.append(make("h3", {}, "Frequency response"));
  curves(home, { title: `${found.output} / ${found.input}`, x, xLabel: label, yLabel: "magnitude [dB]", lines: pair(b.magnitude, b.fit_magnitude), log: true });
  curves(home, { title: "Phase", x, xLabel: label, yLabel: "phase [deg]", lines: pair(b.phase, b.fit_phase), log: true });
  curves(home, { title: "Coherence, from 0.6 on it counts", x, xLabel: label, yLabel: "coherence [1]", lines: [{ name: "", values: b.coherence, colour: 0, dash: [] }], log: true, height: 130, range: [0, 1.02], level: 0.6 });
  home.append(make("p", { class: "soft" }, `0 dB is 1 ${b.unit}. Fitted from ${short(b.fitted[0])} to ${short(b.fitted[1])} Hz.`));
}

function fit(home, found) {
  const { formula, cost, rows } = found.fit;
  home.append(make("h3", {}, "Transfer function"), make("p", { class: "formula" }, formula),
    make("p", { class: "soft" }, `J = ${cost.toFixed(1)} (up to 100 is acceptable)`),
    make("table", {}, make("thead", {}, make("tr", {}, make("th", {}, "parameter"), make("th", { class: "number" }, "value"), make("th", {}, "unit"), make("th", { class: "number" }, "± [%]"))),
      make("tbody", {}, ...rows.map(([name, value, unit, share]) => make("tr", {}, make("td", {}, name), make("td", { class: "number" }, String(+value.toPrecision(4))), make("td", {}, unit), make("td", { class: "number" }, share === null ? "–" : share.toFixed(1)))))));
}

const FILES = { gains: "Parameters", report: "Report", model: "Model", sweep: "CSV", responses: "Responses", fit: "Fit", verification: "Verification" };

function label(name, several) {
  const [, stem, end, suffix] = /^([a-z]+)(?:-(\w+))?\.(\w+)$/.exec(name);
  return `${suffix === "mcap" ? "MCAP" : FILES[stem]}${several && end ? ` ${end}` : ""}`;
}

const link = (name, several) =>
  make("a", { class: "button plain", href: `/download/${name}`, ...(name.endsWith(".html") ? { target: "_blank", rel: "noopener" } : { download: name }), title: name }, label(name, several));

export function result(home, found) {
  const several = found.axes.length > 1, title = found.axes.map((axis) => `${axis.output} / ${axis.input}`).join(", ");
  const first = found.files.filter((name) => /^(gains|report)/.test(name)), more = found.files.filter((name) => !first.includes(name));
  const box = make("section", { class: "result", "data-result": title });
  home.append(box);
  box.append(make("h2", {}, title), found.joined && make("p", { "data-joined": "" }, found.joined) || "",
    make("div", { class: "bar files" }, ...first.map((name) => link(name, several))),
    make("details", { class: "notes" }, make("summary", {}, "More files"), make("div", { class: "bar files" }, ...more.map((name) => link(name, several)))));
  for (const axis of found.axes) {
    const part = make("section", { class: "axis", "data-axis": axis.output });
    box.append(part);
    if (several) part.append(make("h2", {}, `${axis.output} / ${axis.input}`));
    if (axis.alone) part.append(make("p", { class: "soft", "data-alone": "" }, axis.alone.words));
    if (axis.warnings.length) part.append(make("ul", { class: "plain" }, ...axis.warnings.map((text) => make("li", { class: "warn" }, text))));
    gains(part, axis);
    verification(part, axis);
    fit(part, axis);
    bode(part, axis);
  }
  box.append(make("h3", {}, "The same without this page"), block(found.code));
}
