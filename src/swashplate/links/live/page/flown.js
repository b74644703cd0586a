// The flight on this page, turn by turn: what pilots ask of it is done here, at once.
import { Flight } from "./flight.js";

const LONGEST = 0.25; // s of flight that one turn may catch up with

export class Flown {
  constructor({ heard }) {
    this.heard = heard;
    this.speed = 1;
    this.runs = true;
    this.busy = this.left = this.skipped = this.version = 0;
    this.notice = "";
  }

  // A model, and its WebAssembly; `goesOn` from where the last one flies; `logged`: the flight it was learnt from.
  async begin(model, code, { goesOn = false, logged = null } = {}) {
    const { instance } = await WebAssembly.instantiate(code, { math: Math });
    const flight = new Flight(instance, model, logged);
    if (this.flight) flight.follow(this.flight, goesOn);
    this.model = model;
    this.flight = flight;
    this.version += 1;
    this.heard({ type: "hello", version: this.version, ...model.hello });
    this.last = performance.now();
    this.turn(this.last);
  }

  // As far as the clock is; time that a hidden page has slept through is not flown.
  turn(at) {
    if (!this.flight) return;
    const begun = performance.now(), asked = this.runs ? (Math.max(at - this.last, 0) / 1000) * this.speed : 0;
    const due = Math.min(asked, LONGEST * this.speed), { period } = this.flight;
    this.skipped += asked - due;
    this.busy = 0.95 * this.busy; // of a core, over some twenty pictures
    this.left += due;
    for (; this.left >= period; this.left -= period) this.step();
    if (at > this.last) this.busy += (0.05 * (performance.now() - begun)) / (at - this.last);
    this.last = Math.max(at, this.last);
    this.tell();
  }

  step() {
    if (this.flight.step()) this.kept(this.flight.latest);
  }

  tell() {
    const { flight, speed, runs, version, busy, skipped } = this, { setting } = flight;
    this.heard({
      type: "moment", version, t: flight.ticks * flight.period, ...flight.crafts(), fan: flight.fanned(), target: [...flight.target],
      trouble: flight.trouble, runs, speed, busy, skipped, maneuver: flight.maneuverLeft, recordings: [], job: null, frozen: "",
      estimates: [], setting: { ...setting, bar: Boolean(flight.model.hello.barred) }, ...this.more(),
    });
  }

  say(type, fields = {}) {
    const { flight } = this, { value } = fields;
    if (!flight) return;
    if (type !== "stick") this.quiet();
    const does = {
      stick: () => (flight.setting.sticks = fields),
      mode: () => flight.setMode(value),
      decoupled: () => (flight.setting.decoupled = value),
      ghost: () => flight.setGhost(value),
      logged: () => flight.setLogged(value),
      wind: () => (flight.setting.wind = [fields.north, fields.east, fields.down]),
      gusts: () => flight.setGusts(value),
      voltage: () => (flight.setting.voltage = value),
      maneuver: () => flight.flyManeuver(fields.kind, fields.axis, fields.size),
      pause: () => (this.runs = !value),
      step: () => {
        this.runs = false;
        this.step();
      },
      speed: () => (this.speed = value),
      reset: () => {
        this.say("record", { value: false });
        flight.reset();
        this.skipped = 0;
      },
    }[type];
    if (does) does();
    else this.ask(type, fields);
  }

  quiet() {
    this.notice = "";
  }
}
