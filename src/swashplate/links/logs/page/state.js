// What is on the page: logs, their clocks, which channels are drawn, and the stretch of time that is seen.
export const logs = new Map(); // by number, as the server tells them
export const offsets = new Map(); // seconds that are added to a log's own time
export const charts = []; // { key, title, channels: [name, ...] } from above to below
export const seen = { low: 0, high: 1, past: [] }; // shown time [s], and stretches to go back to

const heard = new Map();

export function on(what, does) {
  if (!heard.has(what)) heard.set(what, []);
  heard.get(what).push(does);
}

export function say(what, ...details) {
  for (const does of heard.get(what) ?? []) does(...details);
}

export const ready = () => [...logs.values()].filter((log) => log.state === "ready");
export const offset = (log) => offsets.get(log.id) ?? 0;

// Every channel of every log once, with its group and unit; `raw` are the log's own fields, as it has them.
export function channels() {
  const found = new Map();
  for (const log of ready())
    for (const group of log.groups)
      for (const channel of group.channels) {
        const known = found.get(channel.name);
        if (known) known.logs.push(log.id);
        else found.set(channel.name, { ...channel, group: group.title, raw: Boolean(group.raw), logs: [log.id] });
      }
  return found;
}

// From the begin of the first log to the end of the last one, in shown time.
export function whole() {
  const all = ready();
  if (!all.length) return [0, 1];
  const low = Math.min(...all.map((log) => log.start + offset(log)));
  const high = Math.max(...all.map((log) => log.stop + offset(log)));
  return high > low ? [low, high] : [low - 0.5, high + 0.5];
}

export function look(low, high, { remember = true } = {}) {
  if (!(high - low > 1e-6)) return;
  if (remember) {
    seen.past.push([seen.low, seen.high]);
    if (seen.past.length > 50) seen.past.shift();
  }
  [seen.low, seen.high] = [low, high];
  say("seen");
}

const keyOf = (channel) => `${channel.group} ${channel.unit}`;

export const drawn = (name) => charts.some((chart) => chart.channels.includes(name));

// A channel goes to the chart of its group and unit, or gets one.
export function draw(name, quietly = false) {
  const channel = channels().get(name);
  if (!channel || drawn(name)) return;
  const key = keyOf(channel), home = charts.find((chart) => chart.key === key && chart.channels.length < 8);
  if (home) home.channels.push(name);
  else charts.push({ key, title: channel.group, unit: channel.unit, channels: [name] });
  if (!quietly) say("charts");
}

// Channels that belong in one chart, by a title of their own.
export function drawTogether(title, names) {
  const unit = channels().get(names[0])?.unit ?? "";
  charts.push({ key: title, title, unit, channels: names });
}

export function erase(name) {
  for (const chart of charts) chart.channels = chart.channels.filter((other) => other !== name);
  for (let i = charts.length - 1; i >= 0; i--) if (!charts[i].channels.length) charts.splice(i, 1);
  say("charts");
}
