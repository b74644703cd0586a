// The live page: sticks to the flight, one turn of it, and what it tells to scene, instruments and charts.
import { Connection } from "./connection.js";
import { Charts } from "./charts.js";
import { Instruments } from "./instruments.js";
import { Pace } from "./pace.js";
import { Panel } from "./panel.js";
import { Scene } from "./scene.js";
import { Sticks } from "./sticks.js";

const $ = (id) => document.getElementById(id);
const TOLD_EVERY = 1 / 30; // s of flight between points of charts and trails
const CHARTS_EVERY = 150, HORIZON_EVERY = 50, SHOWN_EVERY = 150; // ms: nobody reads numbers faster

let scene;
try {
  scene = new Scene($("scene"));
} catch (error) {
  $("trouble").hidden = false;
  $("trouble").textContent = "This browser draws no 3D (WebGL is off); charts, sticks and recordings work.";
}
const instruments = new Instruments($("instruments")), pace = new Pace(Boolean(scene?.software));
let charts = null, hello = null, now = null, before = null, charted = 0, drawn = 0, drawnTime = 0, chartsAt = 0, leantAt = 0, shownAt = 0;
let fanBegun = null;
let sent = "";

const connection = new Connection({ heard });
const panel = new Panel((type, fields) => connection.say(type, fields), { view: (name) => scene && (scene.view = name) });
const sticks = new Sticks($("sticks"), { onShortcut: (code) => panel.shortcut(code) });

function heard(message) {
  if (message.type === "hello") {
    hello = message;
    $("title").textContent = hello.title;
    document.title = `${hello.title} · swash live`;
    charts = new Charts($("charts"), hello.inputs, { plain: Boolean(scene?.software), estimates: hello.estimates, fan: hello.fan > 0 });
    scene?.show(hello.picture);
    panel.hello(hello);
    now = before = null;
    charted = -1;
    return;
  }
  if (now && message.t < now.t) {
    charts.clear();
    scene?.clearTrails();
    now = null;
    charted = -1;
  }
  if (!now || message.t > now.t) before = now;
  now = message;
  if (now.t >= charted + TOLD_EVERY) {
    charted = now.t;
    charts.add(now.t, now.own, now.ghost ?? now.logged, now.estimates, now.fan?.x);
    for (const name of ["own", "ghost", "logged"]) if (now[name]) scene?.leaveTrail(name, now[name].x);
    if (now.fan) scene?.leaveFan(now.fan.x, { anew: now.fan.begun !== fanBegun });
    fanBegun = now.fan?.begun ?? null;
  }
  panel.now = now; // what buttons act on is never older than what was heard
}

// Where a body state will be a few milliseconds after it was told, from its last two.
function ahead(name, seconds) {
  const x = now[name].x, old = before?.[name]?.x, span = before ? now.t - before.t : 0;
  if (!old || span <= 0 || span > 0.5 || seconds <= 0) return x;
  return x.map((value, i) => (i < 3 || (i > 5 && i < 9) ? value + ((value - old[i]) * seconds) / span : value));
}

function draw() {
  if (!now) return;
  const late = connection.left, begun = performance.now(); // what is flown is never further than a period behind
  const time = now.t + late, elapsed = Math.min(Math.max(time - drawnTime, 0), 0.1);
  drawnTime = time;
  const rows = {};
  for (const name of ["own", "ghost", "logged"]) if (now[name]) rows[name] = ahead(name, late);
  rows.fan = now.fan?.x;
  scene?.draw(rows, now, elapsed);
  if (begun - leantAt >= HORIZON_EVERY) {
    leantAt = begun;
    instruments.lean(now.own);
  }
  if (begun - shownAt >= SHOWN_EVERY) {
    shownAt = begun;
    panel.show(now);
    instruments.show(now.own, hello.voltages ? `${now.setting.voltage.toFixed(2)} V` : "", hello.picture.rpm);
  }
  pace.took(performance.now() - begun);
  document.documentElement.dataset.drawn = String(Number(document.documentElement.dataset.drawn ?? 0) + 1);
}

function frame(at) {
  steer(Math.min((at - drawn) / 1000, 0.1));
  drawn = at;
  connection.turn(at);
  if (!now || !hello) return;
  if (!pace.due(at)) return;
  draw();
  if (at - chartsAt >= (scene?.software ? 2 : 1) * CHARTS_EVERY) {
    chartsAt = at;
    charts.draw();
  }
}

function steer(elapsed) {
  const axes = sticks.read(elapsed);
  for (const axis of Object.keys(axes)) axes[axis] = Math.round(1000 * axes[axis]) / 1000;
  const text = JSON.stringify(axes);
  panel.gamepad(sticks.gamepad);
  if (text === sent) return;
  sent = text;
  connection.say("stick", axes);
}

window.swash = { connection, sticks, scene, get now() { return now; }, get charts() { return charts; }, pace };
pace.run(frame);
