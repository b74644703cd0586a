// A page without a server: what lies in it of one log answers what the server of `swash open` would.
import { Refused } from "./refused.js";

const kept = JSON.parse(new TextDecoder().decode(window.swashBytes.kept));
export const jobs = kept.jobs;
const bytes = new Uint8Array(window.swashBytes.curves), made = new Map();
const listed = new Map(JSON.parse(document.getElementById("drawn").textContent).map((one) => [one.channel, one]));
const ELSEWHERE = { problem: "This page holds what was made of its log when it was written.", hint: "swash open, with the log itself, does this." };

// Numbers of 32 bits, of which all first bytes lie together, then all second ones.
function numbers(from, count, Kind) {
  const whole = new Uint8Array(4 * count);
  for (let rank = 0; rank < 4; rank++) for (let k = 0; k < count; k++) whole[4 * k + rank] = bytes[from + rank * count + k];
  return new Kind(whole.buffer);
}

function curve(name) {
  if (!made.has(name)) {
    const one = listed.get(name), steps = numbers(one.time, one.count, Int32Array), time = new Float64Array(one.count);
    for (let k = 0, ticks = 0; k < one.count; k++) time[k] = one.begin + (ticks += steps[k]) * one.tick;
    made.set(name, { ...one, time, values: numbers(one.values, one.count, Float32Array) });
  }
  return made.get(name);
}

function begins(time, wanted) {
  let low = 0, high = time.length;
  while (low < high) time[(low + high) >> 1] < wanted ? (low = ((low + high) >> 1) + 1) : (high = (low + high) >> 1);
  return low;
}

// Between two times, with one sample more at each side; of each bin the lowest and the highest, and every gap.
export function trace(name, start, stop, bins) {
  const one = curve(name), first = Math.max(0, begins(one.time, start) - 1);
  let last = begins(one.time, stop);
  while (last < one.count && one.time[last] <= stop) last++;
  last = Math.min(one.count, last + 1);
  const chosen = [], size = Math.ceil((last - first) / bins), thin = last - first > 2 * bins;
  for (let k = first; k < last; k += thin ? size : 1) {
    if (!thin) {
      chosen.push(k);
      continue;
    }
    let low = -1, high = -1, gap = -1;
    for (let i = k; i < Math.min(last, k + size); i++) {
      const value = one.values[i];
      if (Number.isNaN(value)) gap = gap < 0 ? i : gap;
      else {
        if (low < 0 || value < one.values[low]) low = i;
        if (high < 0 || value > one.values[high]) high = i;
      }
    }
    chosen.push(...[...new Set([low, high, gap])].filter((i) => i >= 0).sort((a, b) => a - b));
  }
  const values = chosen.map((i) => (Number.isNaN(one.values[i]) ? null : one.values[i]));
  return { channel: name, unit: one.unit, time: chosen.map((i) => one.time[i]), values, thinned: thin || one.thinned };
}

function told(found) {
  if (!found?.answer) throw new Refused(found ?? ELSEWHERE);
  return found.answer;
}

let job = { state: "none" };
const ANSWERS = {
  "/logs": () => ({ logs: kept.logs, largest: 0, piece: 1, examples: [] }),
  "/job": () => job,
  "/traces": ({ wanted, bins }) => ({ traces: wanted.map(([log, name, start, stop]) => ({ log, ...trace(name, start, stop, bins) })) }),
  "/plot-code": () => null,
  "/review": () => told(kept.review),
  "/track": () => told(kept.track),
  "/map": () => told(kept.map),
  "/spectra": ({ channel }) => told(kept.spectra[channel] ?? { problem: `This page holds spectra of ${Object.keys(kept.spectra).join(", ") || "no channel"}.`, hint: ELSEWHERE.hint }),
  "/identify": ({ sweep, input, output }) => {
    if (input || output || !kept.jobs[sweep]) throw new Refused(ELSEWHERE);
    job = kept.jobs[sweep];
    return { number: sweep, channels: job.channels };
  },
};

export async function post(address, fields) {
  if (!ANSWERS[address]) throw new Refused(ELSEWHERE);
  return ANSWERS[address](fields);
}

export const get = post;
export const answered = async () => {};
export const upload = () => post("/upload");
