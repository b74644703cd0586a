// The replay page: a flight that is all here, scrubbed or played, with the model's prediction as a ghost.
import { Charts } from "./charts.js";
import { Instruments } from "./instruments.js";
import { Scene } from "./scene.js";

const $ = (id) => document.getElementById(id);
const CHARTS_EVERY = 80; // ms

let flight, charts, scene, time = 0, playing = false, last = 0, chartsAt = -1e9, index = -1, dirty = true;
const instruments = new Instruments($("instruments"));
try {
  scene = new Scene($("scene"));
} catch (error) {
  $("trouble").hidden = false;
  $("trouble").textContent = "This browser draws no 3D (WebGL is off); the charts work.";
}

// Index of the last moment at or before a time.
function at(seconds) {
  let low = 0, high = flight.time.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (flight.time[middle] <= seconds) low = middle;
    else high = middle - 1;
  }
  return low;
}

function craft([x, u, rotors, bar, tail]) {
  return { x, u, rotors, bar, tail };
}

function go(seconds) {
  const end = flight.time.at(-1);
  time = Math.min(end, Math.max(0, seconds));
  $("scrub").value = time;
  $("clock").textContent = `${time.toFixed(2)} / ${end.toFixed(1)} s`;
  dirty = true;
}

function play(on) {
  playing = on;
  if (on && time >= flight.time.at(-1)) go(0);
  $("play").textContent = on ? "Pause" : "Play";
}

function draw(now) {
  const k = at(time), own = craft(flight.moments[k]), ghost = flight.moments[k][5];
  const rows = { own: own.x, fan: flight.moments[k][6] }, moment = { own };
  if (ghost) {
    rows.ghost = ghost;
    moment.ghost = own; // its discs are not predicted for drawing
  }
  if (scene) {
    scene.draw(rows, moment, Math.max(0, time - (draw.time ?? time)));
    if (k !== index) {
      scene.clearTrails();
      const span = 400;
      for (let i = Math.max(0, k - span); i <= k; i++) {
        scene.leaveTrail("own", flight.moments[i][0]);
        if (flight.moments[i][5]) scene.leaveTrail("ghost", flight.moments[i][5]);
      }
      leaveWholeFan(k);
      dirty = !playing; // what was left behind is in the next picture
    }
  }
  draw.time = time;
  index = k;
  instruments.lean(own);
  instruments.show(own, "", flight.picture.rpm);
  if (now - chartsAt > CHARTS_EVERY || !playing) {
    chartsAt = now;
    charts.mark(time, own);
  }
}

// All of the lines that began together, also what is still ahead.
function leaveWholeFan(k) {
  const begun = flight.begun?.[k] ?? -1;
  if (!flight.drawn) return;
  let first = k, last = k;
  while (first > 0 && flight.begun[first - 1] === begun) first -= 1;
  while (last + 1 < flight.begun.length && flight.begun[last + 1] === begun) last += 1;
  for (let i = first; i <= last; i++) if (flight.moments[i][6]) scene.leaveFan(flight.moments[i][6]);
}

function frame(now) {
  requestAnimationFrame(frame);
  const elapsed = Math.min((now - last) / 1000, 0.2);
  last = now;
  if (playing) {
    go(time + elapsed * Number($("speed").value));
    if (time >= flight.time.at(-1)) play(false);
  }
  if (!dirty) return;
  dirty = false;
  draw(now);
}

for (const button of document.querySelectorAll("[data-view]"))
  button.onclick = () => {
    if (scene) scene.view = button.dataset.view;
    for (const other of document.querySelectorAll("[data-view]")) other.setAttribute("aria-pressed", other === button);
    dirty = true;
  };
for (const kind of ["pointermove", "wheel"]) $("scene").addEventListener(kind, () => (dirty = true));
new ResizeObserver(() => (dirty = true)).observe($("scene"));

const answer = await fetch("/flight");
flight = await answer.json();
$("title").textContent = flight.title;
document.title = `${flight.title} · swash live --replay`;
$("simulated").hidden = !flight.simulated;
$("state").textContent = flight.vehicle;
const fan = flight.drawn ? ` Thin lines and shaded: ${flight.drawn} models that the fit cannot tell from it.` : "";
$("told").textContent = flight.ahead ? `Blue and dashed: the model, anew every ${flight.ahead} s.${fan}` : "";
$("notes").replaceChildren(
  ...flight.notes.map((words) => Object.assign(document.createElement("p"), { textContent: words })),
);
$("scrub").max = flight.time.at(-1);
$("scrub").oninput = () => go(Number($("scrub").value));
$("play").onclick = () => play(!playing);
window.addEventListener("keydown", (event) => {
  const move = { ArrowLeft: -0.1, ArrowRight: 0.1 }[event.code];
  if (event.code === "Space" && document.activeElement?.tagName !== "BUTTON") play(!playing);
  else if (move && document.activeElement !== $("scrub")) go(time + move);
  else return;
  event.preventDefault();
});
charts = new Charts($("charts"), flight.inputs, { whole: true, plain: Boolean(scene?.software), fan: flight.drawn > 0 });
scene?.show(flight.picture);
const step = flight.time.length > 1 ? flight.time[Math.floor(flight.time.length / 2)] - flight.time[Math.floor(flight.time.length / 2) - 1] : 1;
const broken = (k) => k > 0 && flight.time[k] - flight.time[k - 1] > 2.5 * step;
charts.fill(
  flight.time,
  flight.moments.map((moment, k) => (broken(k) ? null : craft(moment))),
  flight.moments.map((moment) => moment[5] && { x: moment[5] }),
  flight.moments.map((moment) => moment[6]),
);
charts.onPick(go);
go(0);
window.swash = { get time() { return time; }, get index() { return index; }, go, play, scene, flight };
document.documentElement.dataset.ready = "yes";
requestAnimationFrame(frame);
