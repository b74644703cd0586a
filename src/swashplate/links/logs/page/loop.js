// The law of a rate loop around an identified model, as `control/analysis/rate_loop.py` and `rate_loop_steps.py` have it: what a
// set of gains is worth, and how the loop answers. Gains are by their short names, in a loop of rad/s; frequencies in rad/s.
export const RATE = 400;
const WILD = 50, SETTLING = 2, HALF_POWER = 10 ** (-3 / 20), TURN = 2 * Math.PI;

// ---- complex numbers, as [real, imaginary] ----
const times = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
const plus = ([a, b], [c, d]) => [a + c, b + d];
const over = ([a, b], [c, d]) => {
  const size = c * c + d * d;
  return [(a * c + b * d) / size, (b * c - a * d) / size];
};
const scaled = ([a, b], k) => [a * k, b * k];
const size = ([a, b]) => Math.hypot(a, b);
const ONE = [1, 0];
const lag = (w, hertz) => (hertz > 0 ? over(ONE, [1, w / (TURN * hertz)]) : ONE);

// From the rate to the command with its sign turned.
export function controller(k, w, gyro) {
  const s = [0, w], g = (name) => k[name] ?? 0;
  let pid = plus([g("P"), 0], over([g("I"), 0], s));
  pid = plus(pid, times(scaled(s, g("D")), lag(w, g("FLTD"))));
  const c = TURN * gyro, seen = gyro > 0 ? over([c * c, 0], [c * c - w * w, Math.SQRT2 * c * w]) : ONE;
  return times(times(pid, times(lag(w, g("FLTE")), lag(w, g("FLTG")))), seen);
}

// From the demanded rate to the command.
export function ahead(k, w) {
  const own = "FLTG" in k ? { ...k, FLTG: 0, D: 0 } : k;
  return times(lag(w, k.FLTT ?? 0), plus([k.FF ?? 0, 0], controller(own, w, 0)));
}

function unwrapped(angles, period = TURN) {
  const made = angles.slice();
  let turns = 0;
  for (let i = 1; i < angles.length; i++) {
    const step = angles[i] - angles[i - 1];
    let wrapped = ((((step + period / 2) % period) + period) % period) - period / 2;
    if (wrapped === -period / 2 && step > 0) wrapped = period / 2;
    if (Math.abs(step) >= period / 2) turns += wrapped - step;
    made[i] = angles[i] + turns;
  }
  return made;
}

const median = (values) => {
  const sorted = values.slice().sort((a, b) => a - b), n = sorted.length;
  return n % 2 ? sorted[(n - 1) / 2] : (sorted[n / 2 - 1] + sorted[n / 2]) / 2;
};

function crossings(omega, values, level) {
  const made = [];
  for (let k = 0; k + 1 < values.length; k++)
    if (values[k] >= level !== values[k + 1] >= level) made.push(omega[k] * (omega[k + 1] / omega[k]) ** ((values[k] - level) / (values[k] - values[k + 1])));
  return made;
}

function at(omega, values, w) {
  const x = Math.log(w);
  let k = 0;
  while (k + 2 < omega.length && omega[k + 1] <= w) k++;
  const [a, b] = [Math.log(omega[k]), Math.log(omega[k + 1])], share = Math.min(1, Math.max(0, (x - a) / (b - a)));
  return values[k] === values[k + 1] ? values[k] : values[k] + share * (values[k + 1] - values[k]); // also where the gain is nought
}

function leastDelay(omega, loop, gain, phase) {
  const turns = phase.map((p) => Math.floor((p + 180) / 360)), above = gain.map((g) => g > 0);
  let net = above[0] ? turns[0] : 0;
  for (let i = 0; i + 1 < turns.length; i++) if (above[i] && above[i + 1]) net += turns[i + 1] - turns[i];
  if (net !== 0) return 0;
  let least = NaN;
  const sizes = loop.map((z) => Math.log(size(z) + 1e-300)), turned = loop.map(([a, b]) => (((Math.PI + Math.atan2(b, a)) % TURN) + TURN) % TURN);
  for (let i = 0; i + 1 < sizes.length; i++) {
    if (Math.sign(sizes[i]) === Math.sign(sizes[i + 1])) continue;
    const share = sizes[i] / (sizes[i] - sizes[i + 1]), w = omega[i] * (omega[i + 1] / omega[i]) ** share, [a, b] = unwrapped([turned[i], turned[i + 1]]);
    const delay = ((((a + share * (b - a)) % TURN) + TURN) % TURN) / w;
    if (!(delay >= least)) least = delay;
  }
  return least;
}

// Of a broken loop with negative feedback, the least of each kind: crossover, phase and gain margin, delay margin [s].
export function margins(omega, loop) {
  const gain = loop.map((z) => 20 * Math.log10(size(z)));
  let phase = unwrapped(loop.map(([a, b]) => Math.atan2(b, a))).map((p) => (p * 180) / Math.PI);
  const turn = 360 * Math.ceil((median(phase.slice(0, Math.max(1, Math.floor(phase.length / 3)))) - 90) / 360);
  phase = phase.map((p) => p - turn);
  const delay = leastDelay(omega, loop, gain, phase), unstable = delay === 0;
  const rest = (w) => {
    const degrees = at(omega, phase, w) + 180;
    return unstable ? degrees : -((((180 - degrees) % 360) + 360) % 360) + 180;
  };
  let crossover = NaN, phaseMargin = NaN, gainMargin = NaN, first = Infinity;
  const unit = crossings(omega, gain, 0);
  for (const w of unit) if (Math.abs(rest(w)) < first) [first, crossover, phaseMargin] = [Math.abs(rest(w)), w, rest(w)];
  const room = [];
  for (let k = Math.floor(Math.min(...phase) / 360) - 1; k < Math.ceil(Math.max(...phase) / 360) + 1; k++)
    for (const w of crossings(omega, phase, 180 + 360 * k)) room.push(at(omega, gain, w));
  if (room.length) {
    const lost = unstable || (unit.length ? phaseMargin < 0 : median(gain) > 0);
    gainMargin = -(lost ? room.reduce((best, g) => (-g < -best ? g : best)) : room.reduce((best, g) => (Math.abs(g) < Math.abs(best) ? g : best)));
  }
  return { crossover, phase_margin: phaseMargin, gain_margin: gainMargin, delay_margin: delay };
}

// The rate with a set of gains, from a step of the demand and of a disturbance of the command on; NaN once it leaves all bounds.
export function stepped(model, k, gyro, { seconds = SETTLING, target = 1, disturbance = 0 } = {}) {
  const { ad, bd, cd, dd, late } = model, n = ad.length, m = late.length, dt = 1 / RATE, g = (name) => k[name] ?? 0;
  const share = (name) => (g(name) > 0 ? 1 - Math.exp(-TURN * g(name) * dt) : 1), [st, se, sd, sg] = ["FLTT", "FLTE", "FLTD", "FLTG"].map(share);
  const a = (TURN * gyro) / Math.SQRT2, e = Math.exp(-a * dt), [c, s] = [Math.cos(a * dt), Math.sin(a * dt)], w2 = (TURN * gyro) ** 2;
  const held = gyro > 0 ? [[e * (c + s), (e * s) / a], [(-e * s * w2) / a, e * (c - s)]] : null, ofGyro = "FLTG" in k;
  const given = new Array(Math.max(...late)).fill(0), rates = new Array(Math.round(seconds * RATE) + 1).fill(NaN);
  let x = new Array(n).fill(0), y0 = [0, 0], wanted = 0, slow = 0, filtered = 0, sloped = 0, before = 0, summed = 0;
  for (let step = 0; step < rates.length; step++) {
    const acting = late.map((steps) => given[given.length - steps]);
    let y = 0;
    for (let i = 0; i < n; i++) y += cd[i] * x[i];
    for (let j = 0; j < m; j++) y += dd[j] * acting[j];
    if (!(Math.abs(y) < WILD * Math.max(1, Math.abs(target)))) return rates;
    rates[step] = y;
    let seen = y;
    if (held) {
      y0 = [held[0][0] * y0[0] + held[0][1] * y0[1] + (1 - held[0][0]) * y, held[1][0] * y0[0] + held[1][1] * y0[1] - held[1][0] * y];
      seen = y0[0];
    }
    wanted += st * (target - wanted);
    slow += sg * (seen - slow);
    filtered += se * (wanted - slow - filtered);
    summed += filtered * dt;
    const changing = ofGyro ? -slow : filtered;
    sloped += sd * ((changing - before) / dt - sloped);
    before = changing;
    given.push(g("FF") * wanted + g("P") * filtered + g("I") * summed + g("D") * sloped + disturbance);
    given.shift();
    const next = new Array(n).fill(0);
    for (let i = 0; i < n; i++) {
      for (let j = 0; j < n; j++) next[i] += ad[i][j] * x[j];
      for (let j = 0; j < m; j++) next[i] += bd[i][j] * acting[j];
    }
    x = next;
  }
  return rates;
}

// Whether an oscillation is larger in the last third than in the one before, or left all bounds.
export function grows(values) {
  const third = Math.floor(values.length / 3), spread = (part) => Math.max(...part) - Math.min(...part);
  return !(spread(values.slice(2 * third)) < 1.05 * spread(values.slice(third, 2 * third)) + 1e-6);
}

// What a set of gains is worth on a model: `of` has omega, plant [[re, im], ...], gyro [Hz] and the model in time (or null).
export function figures(of, k) {
  const { omega, plant, gyro } = of, loop = omega.map((w, i) => times(controller(k, w, gyro), plant[i]));
  const sensitivity = loop.map((z) => 1 / size(plus(ONE, z))), follows = omega.map((w, i) => size(over(times(plant[i], ahead(k, w)), plus(ONE, loop[i]))));
  const first = (values, passes) => values.findIndex(passes), below = first(follows, (v) => v < HALF_POWER), above = first(sensitivity, (v) => v > HALF_POWER);
  const step = of.model ? stepped(of.model, k, gyro) : null, shaken = of.model ? stepped(of.model, k, gyro, { target: 0, disturbance: 0.1 }) : null;
  return {
    ...margins(omega, loop), loop, step, disturbance: shaken,
    peak: Math.max(...sensitivity),
    bandwidth: below < 0 ? Infinity : below > 0 ? omega[below] : 0,
    rejection: above < 0 ? Infinity : above > 0 ? omega[above] : 0,
    overshoot: step ? Math.max(0, Math.max(...step) - 1) : NaN,
    shaken: shaken ? Math.max(...shaken.map(Math.abs)) : NaN,
    left: shaken ? Math.max(...shaken.slice(-80).map(Math.abs)) : NaN,
    noise: Math.max(...omega.filter((w) => w >= TURN * 10).map((w) => size(controller(k, w, gyro)))),
    stable: step ? !grows(step) && !grows(shaken) : null,
  };
}

const CHANGES = [
  // what, key, unit, scale, better if larger, smallest change that is named (of a number, or of its flown size)
  ["phase margin", "phase_margin", "deg", 1, true, 3, false], ["gain margin", "gain_margin", "dB", 1, true, 0.5, false],
  ["delay margin", "delay_margin", "ms", 1e3, true, 0.05, true], ["largest sensitivity", "peak", "", 1, false, 0.05, true],
  ["bandwidth", "bandwidth", "rad/s", 1, true, 0.05, true], ["disturbance rejection", "rejection", "rad/s", 1, true, 0.05, true],
  ["overshoot of a step", "overshoot", "%", 100, false, 5, false], ["largest answer to a disturbance", "shaken", "deg/s", 180 / Math.PI, false, 0.1, true],
  ["left of a disturbance after 2 s", "left", "deg/s", 180 / Math.PI, false, 0.2, true], ["noise of the gyro in the command", "noise", "s/rad", 1, false, 0.2, true],
];

// What differs from one set of gains to another by more than it matters: words, and whether it is better.
export function changes(flown, mine) {
  const read = (f, key) => (key.endsWith("margin") && Number.isNaN(f[key]) ? Infinity : f[key]), plain = (v) => (!Number.isFinite(v) ? "any" : Math.abs(v) >= 1000 ? v.toFixed(0) : String(+v.toPrecision(3)));
  return CHANGES.flatMap(([what, key, unit, scale, larger, least, relative]) => {
    const before = read(flown, key), after = read(mine, key);
    if (unit === "ms" && Math.max(before, after) >= 1) [scale, unit] = [1, "s"];
    if (before === after) return [];
    const change = scale * (after - before);
    if (!(Math.abs(change) >= (relative && Number.isFinite(before) ? least * Math.abs(scale * before) : least))) return [];
    return [{ words: `${what} ${plain(scale * before)} → ${plain(scale * after)} ${unit}`.trim(), good: change > 0 === larger }];
  });
}
