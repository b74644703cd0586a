// Density, spectrogram and rotor harmonics of one channel over the stretch of time that the plots show.
import uPlot from "/page/vendor/uPlot.esm.js";
import { lines, note } from "./code.js";
import { $, colour, ink, make, short } from "./make.js";
import { post } from "./server.js";
import { spectrogram } from "./spectrogram.js";
import { channels, logs, offset, on, ready, seen } from "./state.js";
import { attempt } from "./trouble.js";

let plot = null, wished = "", last = null, timer = 0;

// What was asked for, else of the channels that a rotor shakes the one with the most samples a second.
const chosen = () => {
  const known = channels();
  if (known.has(wished)) return known.get(wished);
  const shaken = ["p", "az"].map((name) => known.get(name)).filter(Boolean);
  return shaken.sort((a, b) => (b.rate ?? 0) - (a.rate ?? 0))[0] ?? known.values().next().value;
};

const open = () => document.body.dataset.view === "spectrum";

const ask = attempt(async () => {
  const channel = chosen();
  if (!channel || !open()) return;
  const log = logs.get(channel.logs[0]), shift = offset(log);
  const box = $("spectrum").querySelector(".told");
  box.setAttribute("aria-busy", "true");
  try {
    last = await post("/spectra", { log: log.id, channel: channel.name, start: seen.low - shift, stop: seen.high - shift });
  } catch (error) {
    box.replaceChildren(make("p", { class: "soft" }, error.words ?? String(error)));
    return;
  } finally {
    box.removeAttribute("aria-busy");
  }
  last.shift = shift;
  note(last.code);
  draw();
});

function density(home) {
  const { unit, frequency, density: values, rotor } = last;
  const axis = { stroke: ink("soft"), font: "11.5px system-ui, sans-serif", grid: { stroke: ink("grid"), width: 1 }, ticks: { stroke: ink("grid"), size: 4 } };
  const lines = (u) => {
    u.ctx.save();
    u.ctx.fillStyle = ink("red");
    u.ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    u.ctx.textBaseline = "top";
    u.ctx.textAlign = "center";
    let written = -Infinity;
    for (const { number, frequency: at } of rotor.harmonics) {
      const x = u.valToPos(at, "x", true);
      if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) continue;
      u.ctx.globalAlpha = 0.55;
      const head = 14 * devicePixelRatio;
      u.ctx.fillRect(x, u.bbox.top + head, devicePixelRatio, u.bbox.height - head);
      u.ctx.globalAlpha = 1;
      if (x - written < 10 * devicePixelRatio) continue; // numbers would run into each other
      written = x;
      u.ctx.fillText(String(number), x, u.bbox.top);
    }
    u.ctx.restore();
  };
  const decades = (u, ticks) => ticks.map((tick) => {
    const power = Math.log10(tick);
    return Math.abs(power - Math.round(power)) < 1e-6 ? (Math.abs(power) < 4 ? String(+tick.toPrecision(3)) : `1e${Math.round(power)}`) : "";
  });
  plot?.destroy();
  plot = new uPlot({
    width: home.clientWidth || 320, height: 230, legend: { show: false }, padding: [6, 12, 0, 0], cursor: { drag: { x: false, y: false }, y: false },
    scales: { x: { time: false, distr: 3, range: () => [frequency[0], frequency.at(-1)] }, y: { distr: 3 } },
    series: [{}, { stroke: colour(0), width: 1.3, points: { show: false } }],
    axes: [
      { ...axis, label: "frequency [Hz]", labelFont: axis.font, labelSize: 18, size: 24, values: decades },
      { ...axis, label: `density [${unit.includes("/") ? `(${unit})` : unit || "1"}²/Hz]`, labelFont: axis.font, labelSize: 18, size: 46, values: decades },
    ],
    hooks: { draw: [lines] },
  }, [frequency, values], home);
}

function notches(found) {
  const parameters = Object.entries(found.parameters).map(([name, value]) => `${name},${value}`).join("\n");
  return [
    make("h3", {}, "Notch filters"), make("p", parameters ? {} : { class: "soft" }, found.words),
    ...(parameters ? [make("div", { class: "code" }, lines("ArduPilot, with a sensor of the rotor's speed", parameters))] : []),
  ];
}

function harmonics() {
  const { rotor, unit } = last;
  const words = make("p", { class: rotor.harmonics.length ? "" : "soft" }, rotor.words.charAt(0).toUpperCase() + rotor.words.slice(1));
  if (!rotor.harmonics.length) return [make("h3", {}, "Rotor vibration"), words];
  return [
    make("h3", {}, `Rotor vibration: ${rotor.channel} at ${rotor.speed.toFixed(2)} Hz`), words,
    make("table", {}, make("thead", {}, make("tr", {}, make("th", {}, "multiple"), make("th", { class: "number" }, "at [Hz]"), make("th", { class: "number" }, `rms [${unit}]`), make("th", { class: "number" }, "above [dB]"))),
      make("tbody", {}, ...rotor.harmonics.map((h) => make("tr", {}, make("td", {}, `${h.number} ×`), make("td", { class: "number" }, h.frequency.toFixed(2)), make("td", { class: "number" }, short(h.rms)), make("td", { class: "number" }, h.above === null ? "–" : String(Math.round(h.above) + 0)))))),
    ...notches(rotor.notches),
  ];
}

function draw() {
  if (!last || !open()) return;
  const curve = make("div", {}), picture = make("div", {});
  $("spectrum").querySelector(".told").replaceChildren(
    make("h3", {}, "Power spectral density"), curve, make("p", { class: "soft" }, last.words),
    make("h3", {}, "Spectrogram"), picture, ...harmonics(),
  );
  density(curve);
  spectrogram(picture, last.picture, { shift: last.shift, unit: last.unit, rotor: last.rotor });
  $("spectrum").dataset.drawn = last.channel;
}

function list() {
  const select = $("spectrum").querySelector("select"), now = chosen();
  select.replaceChildren(...[...channels().values()].filter((channel) => !channel.raw).map((channel) => make("option", { value: channel.name, selected: channel.name === now?.name }, `${channel.name} [${channel.unit || "–"}]`)));
  soon();
}

function soon() {
  clearTimeout(timer);
  timer = setTimeout(ask, 150);
}

export function begin() {
  const select = make("select", { "aria-label": "channel", onchange: () => {
    wished = select.value;
    ask();
  } });
  $("spectrum").append(make("h2", {}, "Spectrum of "), make("p", { class: "soft" }, "Of the stretch of time that the plots show."), make("div", { class: "told" }));
  $("spectrum").querySelector("h2").append(select);
  on("logs", list);
  on("seen", soon);
  on("view", soon);
  on("theme", draw);
}
