// One small chart of curves over a shared axis, with labels and units: for frequency responses and answers in time.
import uPlot from "/page/vendor/uPlot.esm.js";
import { colour, ink, make, sample } from "./make.js";

const open = new Set();

export function clear() {
  for (const plot of open) plot.destroy();
  open.clear();
}

const log_ticks = (_, ticks) => ticks.map((tick) => (Math.abs(Math.log10(tick) % 1) < 1e-6 ? String(+tick.toPrecision(3)) : ""));

// `lines`: { name, values, colour, dash, points }; what is null is a gap.
export function curves(home, { title, x, xLabel, yLabel, lines, log = false, height = 170, range = null, level = null }) {
  const keys = lines.length > 1 ? lines.filter((line) => !line.hidden).map((line) => make("span", { class: "key" }, sample(colour(line.colour), line.dash), line.name)) : [];
  const box = make("div", {});
  home.append(make("figure", { class: "curves" }, make("figcaption", {}, make("strong", {}, title), ...keys), box));
  const font = "11.5px system-ui, sans-serif";
  const axis = { stroke: ink("soft"), font, labelFont: font, labelSize: 18, grid: { stroke: ink("grid"), width: 1 }, ticks: { stroke: ink("grid"), size: 4 } };
  const draw = (u) => {
    if (level === null) return;
    const y = u.valToPos(level, "y", true);
    u.ctx.fillStyle = ink("red");
    u.ctx.globalAlpha = 0.6;
    u.ctx.fillRect(u.bbox.left, y, u.bbox.width, devicePixelRatio);
    u.ctx.globalAlpha = 1;
  };
  const plot = new uPlot({
    width: box.clientWidth || 330, height, legend: { show: false }, padding: [6, 12, 0, 0], cursor: { show: false },
    scales: { x: { time: false, distr: log ? 3 : 1, range: () => [x[0], x.at(-1)] }, y: range ? { range: () => range } : {} },
    series: [{}, ...lines.map((line) => ({
      stroke: colour(line.colour), width: line.points ? 0 : 1.6, dash: line.dash ?? [],
      points: line.points ? { show: true, size: 4, fill: colour(line.colour), stroke: colour(line.colour) } : { show: false },
    }))],
    axes: [
      { ...axis, label: xLabel, size: 24, ...(log ? { values: log_ticks } : {}) },
      { ...axis, label: yLabel, size: 44, space: 26, values: (_, ticks) => ticks.map((tick) => String(+tick.toPrecision(6))) },
    ],
    hooks: { draw: [draw] },
  }, [x, ...lines.map((line) => line.values)], box);
  open.add(plot);
  return plot;
}
