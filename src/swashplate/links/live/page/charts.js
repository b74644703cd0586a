// Strip charts of the last seconds (live) or of a whole flight (replay), with the second copy dashed.
import uPlot from "./vendor/uPlot.esm.js";

const DEG = 180 / Math.PI;
const COLORS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"];
// s, of the time axis: of a range of no length uPlot may put ticks without end (1 + 1e-16 is 1).
const SHORTEST = 0.1;
const wrapped = (angle) => DEG * Math.atan2(Math.sin(angle), Math.cos(angle));

// One number that is estimated in flight: value, two standard errors to each side, and what the model says.
const estimated = ([name, unit], i) => ({
  title: name, unit: unit || "1", names: ["estimate", "low", "high", "model"], ghost: false, band: true,
  caption: ([value, , high, model]) => [
    value === null ? "not told yet" : `${value.toPrecision(4)} ± ${(high - value).toPrecision(2)}`, "", "",
    model === null ? "" : model.toPrecision(4),
  ],
  read: (_, estimates) => {
    const [value, sigma, model] = estimates[i];
    return value === null ? [null, null, null, model] : [value, value - 2 * sigma, value + 2 * sigma, model];
  },
});

export function panels(inputs, angle, estimates = []) {
  const body = (first, names, unit, shown) => ({
    names, unit, read: (craft) => names.map((_, i) => shown(craft.x[first + i])), ghost: true,
  });
  return [
    ...estimates.map(estimated),
    { title: "Attitude", ...body(6, ["roll", "pitch", "heading"], "deg", angle) },
    { title: "Rates", ...body(9, ["p", "q", "r"], "deg/s", (v) => DEG * v) },
    { title: "Velocities", ...body(3, ["u", "v", "w"], "m/s", (v) => v) },
    {
      title: "Inputs", names: inputs.map((i) => i.name), ghost: false,
      unit: inputs.every((i) => i.unit === "rad") ? "deg" : inputs.every((i) => i.unit === "1") ? "1" : "deg, 1",
      read: (craft) => craft.u.map((v, i) => (inputs[i].unit === "rad" ? DEG * v : v)),
    },
  ];
}

// Lines that the processor draws itself cost half of what its imitation of a graphics card takes for them.
function drawnPlainly(make) {
  const whole = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind) {
    return whole.call(this, kind, { willReadFrequently: true });
  };
  try {
    return make();
  } finally {
    HTMLCanvasElement.prototype.getContext = whole;
  }
}

class Chart {
  constructor(home, panel, plain, fan) {
    this.panel = panel;
    const n = panel.names.length;
    this.fan = fan && panel.ghost;
    this.data = Array.from({ length: 1 + n * (this.fan ? 4 : panel.ghost ? 2 : 1) }, () => []);
    this.box = document.createElement("figure");
    this.box.className = "chart";
    this.box.dataset.chart = panel.title.toLowerCase();
    const head = document.createElement("figcaption");
    const title = document.createElement("strong");
    title.textContent = `${panel.title} [${panel.unit}]`;
    head.append(title);
    this.values = panel.names.map((name, i) => {
      const label = document.createElement("span"), value = document.createElement("output");
      label.style.color = COLORS[panel.band && i < 3 ? 0 : i];
      label.append(name, " ", value);
      label.hidden = Boolean(panel.caption) && i > 0;
      head.append(label);
      return value;
    });
    this.canvas = document.createElement("div");
    this.box.append(head, this.canvas);
    home.append(this.box);
    const series = [{}], line = (i, dash) => ({ stroke: COLORS[i], width: dash ? 1 : 1.5, dash, points: { show: false } });
    const dash = (i) => (!panel.band || i === 0 ? undefined : i === 3 ? [2, 3] : [6, 3]);
    for (let i = 0; i < n; i++) series.push(line(panel.band && i < 3 ? 0 : i, dash(i)));
    if (panel.ghost) for (let i = 0; i < n; i++) series.push(line(i, [5, 4]));
    if (this.fan) for (let i = 0; i < 2 * n; i++) series.push({ points: { show: false } }); // lowest and highest of all
    const paint = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    const axis = { stroke: () => paint("--soft"), font: "11px system-ui", grid: { stroke: () => paint("--grid") }, ticks: { show: false } };
    const make = () => new uPlot({
      width: 300, height: 110, legend: { show: false }, cursor: { show: false }, series,
      bands: panel.band ? [{ series: [3, 2], fill: `${COLORS[0]}2e` }]
        : this.fan ? panel.names.map((_, i) => ({ series: [3 * n + 1 + i, 2 * n + 1 + i], fill: `${COLORS[i]}40` })) : [],
      scales: { x: { time: false }, y: { range: (_, low, high) => this.fixed ?? spread(low, high, panel.band ? 1e-9 : 0.05) } },
      hooks: { draw: [(plot) => this.#mark(plot)] },
      axes: [{ ...axis, size: 22, space: 60 }, { ...axis, size: 46, space: 24 }],
    }, this.data, this.canvas);
    this.plot = plain ? drawnPlainly(make) : make();
  }
  // Lowest and highest of the drawn models, by line.
  spread(rows) {
    const { panel } = this, here = rows?.filter(Boolean).map((x) => panel.read({ x })) ?? [];
    const most = (pick) => panel.names.map((_, i) => (here.length ? pick(...here.map((values) => values[i])) : null));
    return [...most(Math.min), ...most(Math.max)];
  }
  resize() {
    const width = this.canvas.clientWidth, height = Math.max(80, this.box.clientHeight - this.box.firstChild.clientHeight - 2);
    if (width && (width !== this.plot.width || height !== this.plot.height)) this.plot.setSize({ width, height });
  }
  // A line at the time that is shown (replay).
  #mark(plot) {
    if (this.marker === undefined) return;
    const x = Math.round(plot.valToPos(this.marker, "x", true)), { top, height, left, width } = plot.bbox;
    if (x < left || x > left + width) return;
    plot.ctx.fillStyle = getComputedStyle(document.documentElement).color;
    plot.ctx.fillRect(x, top, 1.5, height);
  }
  told(values) {
    const plain = (value) => (Math.abs(value) >= 100 ? value.toFixed(0) : value.toFixed(2));
    const texts = this.panel.caption?.(values) ?? values.map(plain);
    texts.forEach((text, i) => {
      if (this.values[i].textContent === text) return;
      this.values[i].textContent = text;
      this.values[i].parentElement.hidden = !text;
    });
  }
}

function spread(low, high, floor = 0.05) {
  if (low === null || high === null || !Number.isFinite(low + high)) return [-1, 1];
  const least = floor + 0.01 * Math.max(Math.abs(low), Math.abs(high)), middle = (low + high) / 2;
  const half = Math.max((high - low) * 0.56, least);
  return [middle - half, middle + half];
}

export class Charts {
  constructor(home, inputs, { seconds = 20, whole = false, plain = false, estimates = [], fan = false } = {}) {
    home.replaceChildren();
    this.seconds = seconds;
    this.charts = panels(inputs, whole ? (v) => DEG * v : wrapped, estimates).map((panel) => new Chart(home, panel, plain, fan));
    this.pending = false;
    new ResizeObserver(() => this.charts.forEach((chart) => chart.resize())).observe(home);
  }
  clear() {
    for (const { data } of this.charts) data.forEach((column) => (column.length = 0));
  }
  // One more sample at time t; drawn when `draw` is called.
  add(t, own, ghost, estimates = [], fan = null) {
    for (const chart of this.charts) {
      const { data, panel } = chart, n = panel.names.length;
      if (data[0].length && t <= data[0].at(-1)) continue;
      data[0].push(t);
      panel.read(own, estimates).forEach((value, i) => data[1 + i].push(value));
      if (panel.ghost) {
        const values = ghost ? panel.read(ghost) : Array(n).fill(null);
        values.forEach((value, i) => data[1 + n + i].push(value));
      }
      if (chart.fan) chart.spread(fan).forEach((value, i) => data[1 + 2 * n + i].push(value));
      let old = 0;
      while (data[0][old] < t - this.seconds) old += 1;
      if (old > 30) data.forEach((column) => column.splice(0, old));
    }
    this.latest = t;
  }
  draw() {
    for (const chart of this.charts) {
      const { plot, data } = chart;
      if (data[0].length) chart.told(chart.panel.names.map((_, i) => data[1 + i].at(-1)));
      plot.batch(() => {
        plot.setData(data, false);
        const from = Math.max(this.latest - this.seconds, data[0][0] ?? 0);
        plot.setScale("x", { min: Math.min(from, this.latest - SHORTEST), max: this.latest });
      });
    }
  }
  // A whole flight; a craft that is null is a gap. What is predicted does not widen the scale.
  fill(times, crafts, ghosts, fans = []) {
    for (const chart of this.charts) {
      const { panel } = chart, n = panel.names.length;
      const own = crafts.map((craft) => (craft ? panel.read(craft) : Array(n).fill(null)));
      const values = own.flat().filter((value) => value !== null);
      const low = values.reduce((a, b) => Math.min(a, b), Infinity), high = values.reduce((a, b) => Math.max(a, b), -Infinity);
      chart.fixed = spread(low - 0.2 * (high - low), high + 0.2 * (high - low));
      const other = panel.ghost ? ghosts.map((craft) => (craft ? panel.read(craft) : Array(n).fill(null))) : [];
      chart.data = [times, ...panel.names.map((_, i) => own.map((row) => row[i]))];
      if (panel.ghost) chart.data.push(...panel.names.map((_, i) => other.map((row) => row[i])));
      if (chart.fan) {
        const rows = fans.map((fan) => chart.spread(fan));
        chart.data.push(...Array.from({ length: 2 * n }, (_, i) => rows.map((row) => row[i])));
      }
      chart.plot.setData(chart.data);
    }
  }
  mark(time, craft) {
    for (const chart of this.charts) {
      chart.marker = time;
      chart.told(chart.panel.read(craft));
      chart.plot.redraw(false, false);
    }
  }
  // Calls back with the time that is clicked on.
  onPick(pick) {
    for (const { plot } of this.charts)
      plot.over.addEventListener("click", (event) => pick(plot.posToVal(event.offsetX, "x")));
  }
}
