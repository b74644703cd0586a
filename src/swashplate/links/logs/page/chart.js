// One chart: the channels of one group and unit, of every log that has them, over the shown time.
import uPlot from "/page/vendor/uPlot.esm.js";
import { DASHES, colour, ink, make, sample, short } from "./make.js";
import { charts, erase, logs, look, offset, ready, seen } from "./state.js";
import { mark, measured } from "./marks.js";

const LEAST = 170, MOST = 300, TELEPHONE = 165; // px
const sync = uPlot.sync("time");

function spread(_, low, high) {
  if (low === null || high === null || !Number.isFinite(low + high)) return [-1, 1];
  const half = Math.max(0.54 * (high - low), 1e-6 + 0.002 * Math.max(Math.abs(low), Math.abs(high)));
  return [(low + high) / 2 - half, (low + high) / 2 + half];
}

// The time of the cursor, and from the click to there.
export function tellTime(time, from) {
  const seconds = (value) => `${value.toFixed(3)} s`, gone = from === null ? 0 : time - from;
  document.getElementById("cursor").textContent =
    time === null || time === undefined ? "" : from === null ? seconds(time) : `${seconds(time)}, Δ ${seconds(gone)}${Math.abs(gone) > 1e-3 ? ` (${short(1 / Math.abs(gone))} Hz)` : ""}`;
}

export class Chart {
  constructor(home, spec, first) {
    this.spec = spec;
    this.first = first;
    this.series = [];
    spec.channels.forEach((name, i) => {
      ready().forEach((log, k) => {
        if (log.groups.some((group) => group.channels.some((channel) => channel.name === name)))
          this.series.push({ log: log.id, name, i, dash: DASHES[k % DASHES.length], file: log.name });
      });
    });
    this.outputs = this.series.map(() => make("output", {}));
    const several = ready().length > 1;
    const keys = this.series.map((line, k) =>
      make("span", { class: "key", title: several ? line.file : "" }, sample(colour(line.i), line.dash),
        several && line.dash.length ? `${line.name} (${[...logs.keys()].indexOf(line.log) + 1}) ` : `${line.name} `, this.outputs[k]));
    const off = make("button", { class: "off", "aria-label": `remove ${spec.title}`, title: "remove this plot",
      onclick: () => spec.channels.slice().forEach(erase) }, "✕");
    this.canvas = make("div", {});
    this.box = make("figure", { class: "chart", "data-chart": spec.title },
      make("figcaption", {}, make("strong", {}, `${spec.title} [${spec.unit || "–"}]`), ...keys, off), this.canvas);
    home.append(this.box);
    const font = "11.5px system-ui, sans-serif";
    const axis = { stroke: ink("soft"), font, grid: { stroke: ink("grid"), width: 1 }, ticks: { stroke: ink("grid"), size: 4 } };
    this.plot = new uPlot({
      width: 300, height: this.height, legend: { show: false }, padding: [8, 10, 0, 0],
      cursor: { sync: { key: sync.key, scales: ["x", null], filters: { pub: (kind) => kind === "mousemove" || kind === "mouseleave" } }, drag: { x: true, y: false, setScale: false }, points: { show: false } },
      series: [{}, ...this.series.map((line) => ({ stroke: colour(line.i), width: 1.4, dash: line.dash, points: { show: false } }))],
      scales: { x: { time: false, range: () => [seen.low, seen.high] }, y: { range: spread } },
      axes: [
        { ...axis, size: 26, space: 80, values: (_, ticks) => ticks.map((tick) => `${+tick.toPrecision(9)} s`) },
        { ...axis, size: 58, space: 28, values: (_, ticks) => ticks.map((tick) => String(+tick.toPrecision(6))) },
      ],
      hooks: {
        drawAxes: [(plot) => mark(plot, first)],
        setSelect: [(plot) => {
          const { left, width } = plot.select;
          if (width > 4) look(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
          plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        }],
        setCursor: [(plot) => this.#tell(plot.cursor.idx)],
      },
    }, [[], ...this.series.map(() => [])], this.canvas);
    this.resize();
  }

  get height() {
    if (matchMedia("(max-width: 900px)").matches) return TELEPHONE;
    const room = document.getElementById("plots").clientHeight - 70;
    return Math.max(LEAST, Math.min(MOST, Math.floor(room / Math.max(1, charts.length)) - 36));
  }

  // What this chart asks the server for: its lines between the edges of what is seen, in each log's own time.
  wanted() {
    return this.series.map((line) => {
      const shift = offset(logs.get(line.log) ?? { id: line.log });
      return [line.log, line.name, seen.low - shift, seen.high - shift];
    });
  }

  fill(traces) {
    const tables = traces.map((trace) => {
      const shift = offset({ id: trace.log });
      return [trace.time.map((t) => t + shift), trace.values];
    });
    this.data = tables.length === 1 ? tables[0] : uPlot.join(tables);
    this.plot.setData(this.data ?? [[]], true);
  }

  rescale() {
    this.plot.setScale("x", { min: seen.low, max: seen.high });
  }

  // The last value of a line at or before a place in the data; a line need not have a sample just there.
  #before(k, index) {
    const column = this.data?.[k + 1];
    for (let i = index; column && i >= 0 && i > index - 200; i--) if (column[i] !== undefined) return column[i];
    return null;
  }

  // Values at the cursor, and by how much they differ from those at the time that was clicked.
  #tell(index) {
    const from = measured(), there = index !== null && index !== undefined, times = this.data?.[0] ?? [];
    let base = null;
    if (there && from !== null && from >= times[0] && from <= times.at(-1)) {
      let low = 0, high = times.length - 1;
      while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (times[middle] <= from) low = middle;
        else high = middle - 1;
      }
      base = low;
    }
    this.outputs.forEach((output, k) => {
      const value = there ? this.#before(k, index) : null, then = base === null ? null : this.#before(k, base);
      output.replaceChildren(value === null ? "" : short(value), value === null || then === null ? "" : make("i", {}, ` Δ ${short(value - then)}`));
    });
    if (there && this.first) tellTime(times[index], from);
  }

  resize() {
    const width = this.canvas.clientWidth;
    if (width && (width !== this.plot.width || this.height !== this.plot.height)) this.plot.setSize({ width, height: this.height });
  }

  close() {
    this.plot.destroy();
    this.box.remove();
  }
}
