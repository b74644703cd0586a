// Gains to move: flown, suggested and one's own side by side, with what each is worth on the model as the sliders are dragged.
import { curves } from "./curve.js";
import { changes, figures, RATE } from "./loop.js";
import { colour, ink, make, shape, short } from "./make.js";

const WHICH = ["flown", "suggested", "mine"], TINT = { flown: [7, [6, 4]], suggested: [0, []], mine: [1, []] };
const LEAST = { phase_margin: 45, gain_margin: 6 }; // what every suggestion keeps
const ROWS = [
  ["phase margin [deg]", "phase_margin", 1], ["gain margin [dB]", "gain_margin", 1], ["delay margin [ms]", "delay_margin", 1e3], ["crossover [rad/s]", "crossover", 1],
  ["largest sensitivity", "peak", 1], ["bandwidth [rad/s]", "bandwidth", 1], ["disturbance rejection [rad/s]", "rejection", 1], ["overshoot of a step [%]", "overshoot", 100],
  ["largest answer to a disturbance [deg/s]", "shaken", 180 / Math.PI], ["left of a disturbance after 2 s [deg/s]", "left", 180 / Math.PI],
  ["noise of the gyro in the command [s/rad]", "noise", 1],
];

const digits = (value) => (value === null || value === undefined ? "–" : String(+(+value).toPrecision(4)));

// A number with its bound: as many decimals as the bound has with one digit.
function pm([value, sigma], scale) {
  if (value === null) return "–";
  if (!sigma) return short(value * scale);
  const decimals = Math.max(0, Math.min(6, -Math.floor(Math.log10(sigma * scale))));
  return `${(value * scale).toFixed(decimals)} ± ${(sigma * scale).toFixed(decimals)}`.replaceAll(" ", "\u00a0"); // on one line, on a telephone too
}

const loopOf = (axis, values) => Object.fromEntries(axis.gains.map((gain, i) => [gain.short, (values[i] ?? 0) * gain.unit]).filter(([, value], i) => values[i] !== null || !value));

function verdict(axis, worth) {
  const own = worth.mine;
  if (own.stable === false || own.delay_margin === 0) return { words: "Unstable on this model: do not fly these.", bad: true };
  const small = [];
  if (own.phase_margin < LEAST.phase_margin) small.push(`${own.phase_margin.toFixed(0)} deg of phase margin`);
  if (own.gain_margin < LEAST.gain_margin) small.push(`${own.gain_margin.toFixed(1)} dB of gain margin`);
  const less = small.length ? ` Less than a suggestion keeps: ${small.join(", ")}.` : "";
  if (!worth.flown) return { words: `The log holds no flown gains to compare with.${less}`, bad: small.length > 0 };
  const all = changes(worth.flown, own), good = all.filter((one) => one.good).map((one) => one.words), bad = all.filter((one) => !one.good).map((one) => one.words);
  if (!all.length) return { words: `Worth the same as flown.${less}`, bad: small.length > 0 };
  return { words: `Against flown, better: ${good.join(", ") || "nothing"}; worse: ${bad.join(", ") || "nothing"}.${less}`, bad: small.length > 0 || !good.length };
}

// What a firmware takes: parameters of ArduPilot, lines of Rotorflight's command line.
function text(axis, values) {
  const lines = axis.gains.map((gain, i) => [gain.name, values[i]]).filter(([, value]) => value !== null);
  return axis.cli ? [...lines.map(([name, value]) => `set ${name} = ${Math.round(value)}`), "save", ""].join("\n") : [...lines.map(([name, value]) => `${name},${+value.toPrecision(6)}`), ""].join("\n");
}

const EDGE = { left: -2.6, right: 1.4, low: -2, high: 2 }, PIXELS = 100;

// The broken loop in the plane: -1, the unit circle, and the circle within which the sensitivity is above 2.
function nyquist(worth) {
  const place = ([a, b]) => [(a - EDGE.left) * PIXELS, (EDGE.high - b) * PIXELS], [width, height] = [(EDGE.right - EDGE.left) * PIXELS, (EDGE.high - EDGE.low) * PIXELS];
  const inside = ([a, b]) => a > EDGE.left - 1 && a < EDGE.right + 1 && b > EDGE.low - 1 && b < EDGE.high + 1;
  const line = (which) => {
    let path = "", drawing = false;
    for (const z of worth[which].loop) {
      if (!inside(z)) {
        drawing = false;
        continue;
      }
      path += `${drawing ? "L" : "M"}${place(z).map((v) => v.toFixed(1)).join(" ")}`;
      drawing = true;
    }
    return shape("path", { d: path, fill: "none", stroke: colour(TINT[which][0]), "stroke-width": 2, "stroke-dasharray": TINT[which][1].join(" ") });
  };
  const circle = (centre, radius, extra) => shape("circle", { cx: place(centre)[0], cy: place(centre)[1], r: radius * PIXELS, fill: "none", stroke: ink("line"), "stroke-width": 1, ...extra });
  const axis = (d) => shape("path", { d, stroke: ink("grid"), "stroke-width": 1 }), [x0, y0] = place([0, 0]), word = (at, text) => shape("text", { x: place(at)[0], y: place(at)[1] }, text);
  return make("figure", { class: "curves" }, make("figcaption", {}, make("strong", {}, "Nyquist"), make("span", { class: "soft" }, "inside the red circle the sensitivity is above 2")),
    shape("svg", { class: "nyquist", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": "the broken loop in the complex plane" },
      axis(`M 0 ${y0} H ${width}`), axis(`M ${x0} 0 V ${height}`), circle([0, 0], 1, {}), circle([-1, 0], 0.5, { stroke: ink("red"), fill: ink("red-card") }), circle([-1, 0], 0.03, { fill: ink("red"), stroke: "none" }),
      word([-1.1, -0.2], "−1"), word([1.02, -0.14], "1"), ...WHICH.filter((which) => worth[which]).map(line)));
}

export function gains(home, axis) {
  const values = (axis.mine ??= axis.gains.map((gain) => gain.suggested ?? gain.flown)); // kept while the page is drawn anew
  const of = axis.loop;
  const has = (which) => axis.gains.some((gain) => gain[which] !== null);
  const worth = { flown: has("flown") ? figures(of, loopOf(axis, axis.gains.map((g) => g.flown))) : null, suggested: has("suggested") ? figures(of, loopOf(axis, axis.gains.map((g) => g.suggested))) : null };
  const cell = (content, strong = false) => make("td", { class: "number" }, strong ? make("b", {}, content) : content);
  const shown = [], sentence = make("p", { class: "verdict", role: "status" }), table = make("table", { class: "gains" });
  const mineRead = ROWS.map(() => make("td", { class: "number" }));
  const sliders = axis.gains.map((gain, i) => {
    const top = gain.short.startsWith("FLT") ? 80 : 3 * Math.max(gain.flown ?? 0, gain.suggested ?? 0) || (axis.cli ? 100 : 0.1);
    const number = make("input", { type: "number", min: 0, step: "any", value: digits(values[i] ?? 0), "aria-label": `${gain.name}, mine` });
    const slider = make("input", { type: "range", min: 0, max: top, step: axis.cli ? 1 : top / 400, value: values[i] ?? 0, "aria-label": `slide ${gain.name}`, "data-gain": gain.short });
    const take = (value) => {
      if (!Number.isFinite(value) || value < 0) return;
      values[i] = axis.cli ? Math.round(value) : value;
      draw();
    };
    slider.oninput = () => {
      number.value = digits(slider.valueAsNumber);
      take(slider.valueAsNumber);
    };
    number.oninput = () => {
      slider.value = number.valueAsNumber;
      take(number.valueAsNumber);
    };
    shown.push(() => {
      slider.value = values[i] ?? 0;
      number.value = digits(values[i] ?? 0);
    });
    return [make("tr", {}, make("td", {}, ...gain.name.split(/(?<=_)/).flatMap((part) => [part, make("wbr")])), cell(digits(gain.flown)), cell(digits(gain.suggested), true), make("td", { class: "number" }, number)), make("tr", { class: "slide" }, make("td", { colspan: 4 }, slider))];
  });
  const read = (which, [, key, scale]) => {
    const bound = axis[which]?.[key]; // with the error of the fit
    if (Array.isArray(bound)) return pm(bound, scale);
    return worth[which] ? short(worth[which][key] * scale) : "–";
  };
  const rows = ROWS.map((row, i) => make("tr", {}, make("td", {}, row[0]), cell(read("flown", row)), cell(read("suggested", row)), mineRead[i]));
  table.append(make("thead", {}, make("tr", {}, make("th", {}, ""), ...WHICH.map((which) => make("th", { class: "number" }, which)))), make("tbody", {}, ...sliders.flat(), ...rows));
  const back = (label, which) => make("button", { onclick: () => {
    axis.gains.forEach((gain, i) => (values[i] = gain[which]));
    shown.forEach((show) => show());
    draw();
  } }, label);
  const away = make("button", { class: "first", "data-mine": "", onclick: () => {
    const link = make("a", { href: URL.createObjectURL(new Blob([text(axis, values)], { type: "text/plain" })), download: axis.cli ? "mine.txt" : "mine.param" });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  } }, axis.cli ? "My gains (CLI)" : "My gains (.param)");
  const pictures = make("div", {});
  home.append(make("p", { class: "why" }, axis.words), table, make("div", { class: "bar" }, has("suggested") && back("Mine = suggested", "suggested") || "", has("flown") && back("Mine = flown", "flown") || "", away), sentence, pictures);
  const step = make("div", {}), plane = make("div", {}), plots = [];
  pictures.append(step, plane);
  let waiting = 0;
  function picture() {
    const those = WHICH.filter((which) => worth[which]), values = (which, key, scale) => worth[which][key].map((v) => (Number.isFinite(v) ? v * scale : null));
    const lines = (key, scale = 1) => those.map((which) => ({ name: which, values: values(which, key, scale), colour: TINT[which][0], dash: TINT[which][1] }));
    plane.replaceChildren(nyquist(worth));
    if (worth.mine.step) {
      const x = worth.mine.step.map((_, i) => i / RATE), both = [lines("step"), lines("disturbance", 180 / Math.PI)];
      if (plots.length) plots.forEach((plot, k) => plot.setData([x, ...both[k].map((line) => line.values)]));
      else
        plots.push(curves(step, { title: "Step of the target", x, xLabel: "time [s]", yLabel: "rate / target [1]", lines: both[0], level: 1 }),
          curves(step, { title: "Disturbance: 0.1 of the command", x, xLabel: "time [s]", yLabel: `${axis.rate} [deg/s]`, lines: both[1] }));
    }
    home.dataset.drawn = String(Number(home.dataset.drawn ?? 0) + 1);
  }
  function draw() {
    worth.mine = figures(of, loopOf(axis, values));
    ROWS.forEach(([, key, scale], i) => (mineRead[i].textContent = short(worth.mine[key] * scale)));
    const { words, bad } = verdict(axis, worth);
    sentence.textContent = words;
    sentence.classList.toggle("warn", bad);
    away.disabled = worth.mine.stable === false || worth.mine.delay_margin === 0;
    cancelAnimationFrame(waiting);
    waiting = requestAnimationFrame(picture);
  }
  draw();
  if (worth.suggested?.stable === false) home.append(make("p", { class: "warn", role: "alert" }, "The suggested gains are unstable on this model. Do not fly them."));
  if (worth.flown?.stable === false) home.append(make("p", { class: "warn", role: "alert" }, "On this model the flown gains do not settle, and the aircraft flew with them: do not trust the model."));
  home.append(make("p", { class: "soft" }, "The loop is closed on the model at 400 Hz. The target steps at once; ArduPilot's own shaping of the target is not in it. Mine has no bounds: those of the suggestion are the fit's."));
}
