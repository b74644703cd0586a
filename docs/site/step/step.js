// A vehicle's answer to a step of one control, computed here by its own C as WebAssembly, beside the card's as it is.
import { curves } from "/open/curve.js";
import { $, make } from "/open/make.js";

const picture = JSON.parse($("picture").textContent);
const PLOTS = [["Rates", "deg/s", ["p", "q", "r"]], ["Attitude", "deg", ["phi", "theta", "psi"]], ["Velocity", "m/s", ["u", "v", "w"]]];
const degrees = (unit) => (unit.startsWith("deg") ? 180 / Math.PI : 1);

// Each craft with its numbers in the module's memory: x, u, s and p one after the other.
const crafts = await Promise.all(picture.crafts.map(async (craft, k) => {
  const { instance } = await WebAssembly.instantiate(window.swashBytes[`flight${k || ""}`], { math: Math });
  const { m_step, numbers, memory } = instance.exports, begin = numbers(), lengths = [craft.states.length, picture.inputs.length, craft.s.length, craft.p.length];
  let at = begin;
  const places = lengths.map((length) => {
    const place = at;
    at += 8 * length;
    return place;
  });
  const [x, u, s, p] = places.map((place, i) => new Float64Array(memory.buffer, place, lengths[i]));
  return { ...craft, x, u, s, p, step: () => m_step(...places, picture.dt) };
}));

// States of each step, from the trim at a speed, with one input off its trim by a share of its range.
export function flown({ craft, speed, knob, input, size }) {
  const one = crafts[craft], trim = one.trims[speed], { low, high } = picture.inputs[input];
  one.x.set(trim.x);
  one.u.set(trim.u);
  one.s.set(picture.crafts[craft].s);
  one.p.set(picture.crafts[craft].p);
  if (picture.knob) one.p[picture.knob.place] = knob;
  one.u[input] += size * (high - low);
  const rows = [[...one.x]];
  for (let k = 0; k < picture.steps; k++) {
    one.step();
    rows.push([...one.x]);
  }
  return rows;
}

const asIs = { craft: 0, speed: 0, knob: picture.knob?.value ?? 0 };
const now = { ...asIs, craft: picture.crafts.length - 1, knob: picture.knob ? picture.knob.high : 0, speed: picture.crafts[0].trims.length > 1 ? picture.shownSpeed : 0, input: picture.input, size: 0.05 };
const time = Array.from({ length: picture.steps + 1 }, (_, k) => k * picture.dt);
const plots = [];

function draw() {
  const rows = [[now, []], [{ ...asIs, input: now.input, size: now.size }, [4, 4]]].map(([setting, dash]) => ({ rows: flown(setting), names: crafts[setting.craft].states, dash }));
  PLOTS.forEach(([title, unit, names], k) => {
    const lines = rows.flatMap(({ rows: all, names: states, dash }, j) => names.map((name, i) => ({
      name, colour: i, dash, hidden: j > 0, values: all.map((row) => (Number.isFinite(row[states.indexOf(name)]) ? row[states.indexOf(name)] * degrees(unit) : null)) })));
    if (plots[k]) plots[k].setData([time, ...lines.map((line) => line.values)]);
    else plots.push(curves($("plots"), { title, x: time, xLabel: "time [s]", yLabel: unit, lines, height: 135 }));
  });
  const { name, unit, low, high } = picture.inputs[now.input], moved = now.size * (high - low) * (unit === "rad" ? 180 / Math.PI : 1);
  const told = [`Solid: ${name} off its trim by ${moved.toPrecision(3)}${unit === "rad" ? " deg" : unit === "1" ? "" : ` ${unit}`}`, picture.crafts.length > 1 && picture.crafts[now.craft].label, picture.knob && `${picture.knob.name} = ${now.knob.toFixed(2)}`, crafts[0].trims.length > 1 && `${crafts[now.craft].trims[now.speed].speed} m/s`].filter(Boolean).join(", ");
  const beyond = picture.fastest !== null && crafts[now.craft].trims[now.speed].speed > picture.fastest;
  $("words").textContent = `${told}. Dashed: ${picture.asIs}.${beyond ? ` The card may be trusted up to ${picture.fastest} m/s only.` : ""}`;
  $("words").classList.toggle("warn", beyond);
  document.documentElement.dataset.drawn = String(Number(document.documentElement.dataset.drawn ?? 0) + 1);
}

function slider(words, { low, high, step, value, told }, take) {
  const shown = make("output", {}, told(value)), box = make("input", { type: "range", min: low, max: high, step, value, "aria-label": words });
  box.oninput = () => {
    take(box.valueAsNumber);
    shown.textContent = told(box.valueAsNumber);
    draw();
  };
  return make("label", {}, words, box, shown);
}

const choose = make("select", { "aria-label": "control", onchange: () => ((now.input = choose.selectedIndex), draw()) }, ...picture.inputs.map(({ name }, k) => make("option", { selected: k === now.input }, name)));
const bar = picture.crafts.length > 1 && make("label", {}, make("input", { type: "checkbox", checked: true, "aria-label": "other craft", onchange: (event) => ((now.craft = event.target.checked ? 1 : 0), draw()) }), picture.crafts[1].label);
$("knobs").append(...[
  make("label", {}, "step of", choose),
  slider("size", { low: 0.01, high: 0.1, step: 0.01, value: now.size, told: (v) => `${(100 * v).toFixed(0)} % of its range` }, (v) => (now.size = v)),
  bar,
  picture.knob && slider(picture.knob.name, { low: picture.knob.low, high: picture.knob.high, step: 0.05, value: now.knob, told: (v) => v.toFixed(2) }, (v) => (now.knob = v)),
  crafts[0].trims.length > 1 && slider("speed", { low: 0, high: crafts[0].trims.length - 1, step: 1, value: now.speed, told: (v) => `${crafts[0].trims[v].speed} m/s` }, (v) => (now.speed = v)),
].filter(Boolean));
draw();
window.step = { flown };
