// The track in three dimensions with the attitude as logged: scrubbed, played, or at the time that the plots show.
import { Instruments } from "/page/instruments.js";
import { Scene } from "/page/scene.js";
import { note } from "./code.js";
import { choose } from "./marks.js";
import { $, make } from "./make.js";
import { post } from "./server.js";
import { offset, on, ready, say } from "./state.js";
import { attempt } from "./trouble.js";

let scene = null, instruments = null, flight = null, time = 0, playing = false, last = 0, markedAt = 0, of = 0, dirty = true;
const open = () => document.body.dataset.view === "track";

function index(seconds) {
  const { time: all } = flight, n = all.length;
  return Math.max(0, Math.min(n - 1, Math.round(((seconds - all[0]) / (all[n - 1] - all[0] || 1)) * (n - 1))));
}

function row(k) {
  return [...flight.places[k], ...flight.speeds[k], ...flight.angles[k], 0, 0, 0];
}

function go(seconds, tell = true) {
  time = Math.min(flight.time.at(-1), Math.max(flight.time[0], seconds));
  $("scrub").value = time;
  $("clock").textContent = `${(time + flight.shift).toFixed(2)} s`;
  dirty = true;
  if (tell && performance.now() - markedAt > 120) {
    markedAt = performance.now();
    choose(time + flight.shift);
    say("marks");
  }
}

function draw(elapsed) {
  const k = index(time), x = row(k), still = [0, 0, 30, 0, 0, 0];
  const own = { x, u: [], rotors: Array.from({ length: flight.rotors }, () => still), bar: [0, 0], tail: flight.tail ? [120, 0] : null };
  scene.draw({ own: x }, { own }, elapsed);
  scene.clearTrails();
  const step = Math.max(1, Math.floor(flight.time.length / 800));
  for (let i = 0; i <= k; i += step) scene.leaveTrail("own", flight.places[i]);
  scene.leaveTrail("own", x);
  instruments.show(own, "", false);
}

function frame(now) {
  requestAnimationFrame(frame);
  const elapsed = Math.min((now - last) / 1000, 0.2);
  last = now;
  if (!flight || !scene || !open()) return;
  if (playing) {
    go(time + elapsed * Number($("pace").value));
    if (time >= flight.time.at(-1)) play(false);
  }
  if (!dirty) return;
  dirty = false;
  draw(playing ? elapsed : 0);
}

function play(wanted) {
  playing = wanted;
  $("play").textContent = wanted ? "Pause" : "Play";
  if (wanted && time >= flight.time.at(-1)) go(flight.time[0]);
}

const fetchTrack = attempt(async () => {
  const [log] = ready();
  if (!open() || !log || of === `${log.id} ${log.version}`) return;
  of = `${log.id} ${log.version}`;
  const words = $("track").querySelector(".soft");
  words.textContent = "asking for the track …";
  try {
    flight = await post("/track", { log: log.id });
  } catch (error) {
    flight = null;
    $("stage").hidden = $("player").hidden = true;
    words.textContent = error.words ?? String(error);
    return;
  }
  flight.shift = offset(log);
  note(flight.code);
  $("stage").hidden = $("player").hidden = false;
  words.textContent = flight.notes.join(" ");
  try {
    scene ??= new Scene($("scene"));
  } catch {
    words.textContent = "This browser draws no three dimensions (WebGL is off); everything else works.";
    $("stage").hidden = true;
    return;
  }
  scene.show(flight.picture);
  $("instruments").querySelector("dl").hidden = !flight.placed; // without a place no height and no speed
  $("scrub").min = flight.time[0];
  $("scrub").max = flight.time.at(-1);
  go(flight.time[0], false);
  $("track").dataset.drawn = String(flight.time.length);
});

export function begin() {
  const views = ["chase", "above", "pilot"].map((name, i) => make("button", { "data-camera": name, "aria-pressed": String(i === 0), onclick: (event) => {
    scene.view = name;
    for (const button of event.target.parentElement.children) button.setAttribute("aria-pressed", button === event.target);
    dirty = true;
  } }, { chase: "Chase", above: "Above", pilot: "Pilot" }[name]));
  $("track").append(
    make("h2", {}, "Track and attitude"),
    make("div", { id: "stage" }, make("canvas", { id: "scene", "aria-label": "the flight in three dimensions" }), make("div", { id: "instruments" }), make("div", { class: "cameras" }, ...views)),
    make("div", { id: "player", class: "bar" }, make("button", { id: "play", onclick: () => play(!playing) }, "Play"),
      make("select", { id: "pace", "aria-label": "speed" }, ...[0.25, 0.5, 1, 2, 5, 10].map((v) => make("option", { value: v, selected: v === 1 }, `${v}×`))),
      make("input", { id: "scrub", type: "range", step: "any", "aria-label": "time", oninput: () => go(Number($("scrub").value)) }), make("output", { id: "clock" })),
    make("p", { class: "soft" }),
  );
  instruments = new Instruments($("instruments"));
  for (const kind of ["pointermove", "wheel"]) $("scene").addEventListener(kind, () => (dirty = true));
  new ResizeObserver(() => (dirty = true)).observe($("scene"));
  on("view", fetchTrack);
  on("logs", fetchTrack);
  requestAnimationFrame(frame);
}
