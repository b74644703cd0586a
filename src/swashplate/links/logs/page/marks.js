// What is marked in every chart: sweeps as bands, modes as a strip above, and the event that was chosen.
import { ink } from "./make.js";
import { offset, ready } from "./state.js";

let chosen = null;

export function choose(time) {
  chosen = time;
}

// The time from which differences are measured, where one was clicked.
export const measured = () => chosen;

const MOST_WORDS = 40; // events of which the first chart tells more than the place

function clipped(plot, low, high) {
  const { left, width } = plot.bbox;
  const a = Math.max(left, plot.valToPos(low, "x", true)), b = Math.min(left + width, plot.valToPos(high, "x", true));
  return b > a ? [a, b] : null;
}

function label(ctx, text, a, b, top) {
  const room = b - a - 8 * devicePixelRatio;
  if (room < 20 * devicePixelRatio) return;
  let shown = text;
  while (shown.length > 1 && ctx.measureText(shown).width > room) shown = `${shown.slice(0, -2)}…`;
  if (shown.length > 2) ctx.fillText(shown, a + 4 * devicePixelRatio, top);
}

// Events above, changes of parameters with them: a tick each, with words where there is room.
function ticks(plot, log, first) {
  const { ctx, bbox } = plot, scale = devicePixelRatio, shift = offset(log);
  const all = [...log.events.filter((event) => event.kind !== "mode" && event.kind !== "sweep"), ...log.changes.map((change) => ({ ...change, kind: "parameter", text: `${change.name} ${change.value}` }))];
  const seen = all.filter((event) => event.time + shift >= plot.scales.x.min && event.time + shift <= plot.scales.x.max).sort((a, b) => a.time - b.time);
  let free = -Infinity;
  for (const event of seen) {
    const x = plot.valToPos(event.time + shift, "x", true);
    ctx.fillStyle = ink(event.kind === "parameter" ? "c3" : "soft");
    ctx.fillRect(x, bbox.top, scale, (first ? 6 : 4) * scale);
    if (!first || x < free || seen.length > MOST_WORDS) continue;
    const words = event.text.length > 24 ? `${event.text.slice(0, 23)}…` : event.text, width = ctx.measureText(words).width;
    if (x + width > bbox.left + bbox.width) continue;
    ctx.fillText(words, x + 2 * scale, bbox.top + bbox.height - 31 * scale);
    ctx.globalAlpha = 0.35;
    ctx.fillRect(x, bbox.top, scale, bbox.height);
    ctx.globalAlpha = 1;
    free = x + width + 8 * scale;
  }
}

export function mark(plot, first) {
  const { ctx, bbox } = plot, scale = devicePixelRatio;
  ctx.save();
  ctx.font = `${11 * scale}px system-ui, sans-serif`;
  ctx.textBaseline = "top";
  ctx.textAlign = "left";
  const rows = []; // where the labels of each row end: of logs over each other, each sweep's label stands below the last
  for (const log of ready()) {
    const shift = offset(log);
    for (const sweep of log.sweeps) {
      const edges = clipped(plot, sweep.start + shift, sweep.stop + shift);
      if (!edges) continue;
      ctx.fillStyle = ink("band");
      ctx.fillRect(edges[0], bbox.top, edges[1] - edges[0], bbox.height);
      if (first) {
        ctx.fillStyle = ink("blue");
        const words = `sweep ${sweep.axis}, ${+sweep.low.toPrecision(3)} to ${+sweep.high.toPrecision(3)} Hz`;
        let row = rows.findIndex((end) => end < edges[0]);
        if (row < 0) row = rows.push(0) - 1;
        rows[row] = Math.min(edges[1], edges[0] + ctx.measureText(words).width + 12 * scale);
        label(ctx, words, ...edges, bbox.top + (3 + 14 * row) * scale);
      }
    }
  }
  for (const log of ready()) ticks(plot, log, first);
  const [log] = ready();
  if (log) {
    log.modes.forEach((mode, k) => {
      const edges = clipped(plot, mode.start + offset(log), mode.stop + offset(log));
      if (!edges) return;
      ctx.fillStyle = k % 2 ? ink("line") : ink("soft");
      ctx.fillRect(edges[0], bbox.top + bbox.height - 3 * scale, edges[1] - edges[0], 3 * scale);
      if (first) {
        ctx.fillStyle = ink("soft");
        label(ctx, mode.text, ...edges, bbox.top + bbox.height - 17 * scale);
      }
    });
  }
  if (chosen !== null) {
    const x = plot.valToPos(chosen, "x", true);
    if (x >= bbox.left && x <= bbox.left + bbox.width) {
      ctx.fillStyle = ink("red");
      ctx.fillRect(x, bbox.top, 1.5 * scale, bbox.height);
    }
  }
  ctx.restore();
}
