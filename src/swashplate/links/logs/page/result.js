// What came of a sweep: gains first, then what they rest on: answers in time, verification, fit, frequency response.
import { block } from "./code.js";
import { curves } from "./curve.js";
import { gains } from "./gains.js";
import { make, short } from "./make.js";

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
  if (found.off.length) {
    curves(home, { title: `Off axis: what ${found.input} does elsewhere`, x, xLabel: label, yLabel: `dB of ${found.output}`, log: true, level: 0,
      lines: found.off.map((one, i) => ({ name: `${one.output} / ${found.output}`, values: one.share, colour: 2 + i, points: true })) });
    home.append(make("ul", { class: "plain", "data-off": "" }, ...found.off.map((one) => make("li", {}, one.words))));
  }
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
  const [, stem, end] = /^([a-z]+)(?:-(\w+))?\.\w+$/.exec(name);
  return `${FILES[stem]}${several && end ? ` ${end}` : ""}`;
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
    for (const loop of axis.gains) {
      const home = make("section", { class: "tune", "data-loop": loop.axis });
      part.append(home);
      gains(home, loop);
    }
    if (axis.no_gains) part.append(make("p", { class: "warn", role: "alert", "data-no-gains": "" }, `No gains. ${axis.no_gains}`));
    verification(part, axis);
    fit(part, axis);
    bode(part, axis);
  }
  box.append(make("h3", {}, "The same without this page"), block(found.code));
}
