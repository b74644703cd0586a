// One helicopter and what flies beside it, a period of the controller at a time: `links/live/world.py` over WebAssembly.
const PARTS = ["x", "past", "carried", "inputs", "card", "sensors", "read", "wanted", "gains", "around", "added", "limits", "draws"];
const OWN = 7; // of the parts, those that each craft has
const HELD = 3; // m from a place that is held, beyond which it is not
const LEAN = Math.PI / 3; // where a linear model tells nothing any more

function normal() {
  return Math.sqrt(-2 * Math.log(1 - Math.random())) * Math.cos(2 * Math.PI * Math.random());
}

export class Flight {
  constructor(instance, model, logged = null) {
    const { frame, buffer, delays, sense, memory } = instance.exports;
    this.model = model;
    this.logged = logged; // body states, twelve a row, of the flight it was learnt from
    this.period = model.period;
    this.frame = frame;
    this.sense = sense;
    const { states, hello, sizes } = model, m = hello.inputs.length;
    const long = { x: states.length, past: sizes.depth * m, carried: sizes.carried, inputs: m, card: model.card.length,
      sensors: model.sensors[0].length, read: states.length, wanted: 10,
      gains: sizes.gains, around: 4, added: m, limits: 2 * m, draws: sizes.draws };
    const array = (which, craft) => new Float64Array(memory.buffer, buffer(which, craft), long[PARTS[which]]);
    this.places = Array.from({ length: sizes.crafts }, (_, craft) => Object.fromEntries(PARTS.slice(0, OWN).map((name, i) => [name, array(i, craft)])));
    PARTS.slice(OWN).forEach((name, i) => (this[name] = array(OWN + i, 0)));
    this.limits.set([...hello.inputs.map(({ low }) => low), ...hello.inputs.map(({ high }) => high)]);
    this.places.forEach(({ card, sensors }, i) => {
      const drawn = Math.max(0, i - 1); // it and its ghost, then the drawn models
      card.set(drawn ? model.draws[drawn - 1] : model.card);
      sensors.set(model.sensors[drawn]);
      new Int32Array(memory.buffer, delays(i), model.back[drawn].length).set(model.back[drawn]);
    });
    this.setting = { mode: model.mode, decoupled: true, ghost: false, logged: false, wind: [0, 0, 0], gusts: 0, voltage: model.voltage,
      sticks: { roll: 0, pitch: 0, yaw: 0, heave: 0 } };
    this.place = Object.fromEntries(["x", "y", "z", "u", "v", "w", "phi", "theta", "psi"].map((name) => [name, states.findIndex(([n]) => n === name)]));
    this.reset();
  }

  // The switches of the flight before; `goesOn` from where it is.
  follow(old, goesOn) {
    const { mode } = old.setting;
    this.setting = { ...old.setting, mode: this.model.gains[mode] ? mode : this.model.mode };
    this.reset();
    if (!goesOn) return;
    for (const craft of [0, 1]) for (const part of ["x", "past", "carried", "inputs"]) this.places[craft][part].set(old.places[craft][part]);
    const { ticks, target, air, maneuver, trouble } = old;
    Object.assign(this, { ticks, target, air, maneuver, trouble });
    this.setting = { ...old.setting };
    this.#beginFan();
  }

  // ---- what the pilot does
  reset() {
    this.ticks = 0;
    this.trouble = "";
    this.maneuver = null;
    this.setting.wind = [0, 0, 0];
    this.setGusts(0);
    this.#fresh(0);
    if (this.setting.ghost) this.#fresh(1);
    this.setLogged(this.setting.logged);
    this.#take();
    this.#beginFan();
  }
  #fresh(craft) {
    const { x, past, carried, inputs } = this.places[craft], { trim } = this.model;
    x.set(trim.x);
    inputs.set(trim.u);
    for (let k = 0; k < past.length; k += inputs.length) past.set(trim.u, k);
    carried.set(this.model.carried);
  }
  #copy(to) {
    for (const part of ["x", "past", "carried", "inputs"]) this.places[to][part].set(this.places[0][part]);
  }
  #take() {
    this.sense(0);
    const { read } = this.places[0], { place } = this;
    this.target = [read[place.x], read[place.y], read[place.z], read[place.psi]];
  }
  #beginFan() {
    this.fan = this.model.draws.map((_, i) => i + 2);
    this.fan.forEach((craft) => this.#copy(craft));
    this.fanBegun = this.ticks;
  }
  setMode(mode) {
    if (mode === this.setting.mode || !this.model.gains[mode]) return;
    this.setting.mode = mode;
    for (const { carried } of this.places) carried.set(this.model.carried);
    this.#beginFan();
    this.#take();
  }
  setGhost(on) {
    this.setting.ghost = on;
    if (on) this.#copy(1);
  }
  // The flight it was learnt from begins beside where it is.
  setLogged(on) {
    const { x } = this.places[0], { place, logged } = this, beside = 3 * this.model.hello.picture.size;
    this.setting.logged = on && logged !== null;
    if (!this.setting.logged) return;
    this.loggedFrom = [x[place.x] - logged[0], x[place.y] - logged[1] + beside, x[place.z] - logged[2], this.ticks];
  }
  #loggedNow() {
    const { logged, loggedFrom, model } = this, [north, east, down, begun] = loggedFrom, count = logged.length / 12;
    const at = ((this.ticks - begun) * this.period * model.logged) % (count - 1), k = Math.floor(at);
    const row = (i) => logged.subarray(12 * i, 12 * i + 12), [now, next] = [row(k), row(k + 1)];
    const x = [...now].map((value, i) => (Math.abs(next[i] - value) > 3 ? value : value + (at - k) * (next[i] - value))); // a heading turns over
    return [x[0] + north, x[1] + east, x[2] + down, ...x.slice(3)];
  }
  setGusts(sigma) {
    this.setting.gusts = sigma;
    this.air = sigma ? this.model.gusts.map(({ start }) => start.map((row) => row.reduce((sum, part) => sum + part * normal(), 0))) : null;
  }
  flyManeuver(kind, axis, size) {
    this.maneuver = { shape: this.model.maneuvers[kind], vector: this.model.axes[axis].map((part) => part * size), begun: this.ticks };
  }
  get maneuverLeft() {
    return this.maneuver ? Math.max(0, (this.maneuver.shape.length - (this.ticks - this.maneuver.begun)) * this.period) : 0;
  }

  // ---- time
  step() {
    if (this.trouble) return false;
    const { setting, places, model, place } = this, own = places[0], before = [...own.x];
    this.#ask();
    this.#blow();
    this.#add();
    if (this.fan.length && (this.ticks - this.fanBegun) * this.period >= model.hello.fan_seconds) this.#beginFan();
    for (const craft of [0, ...(setting.ghost ? [1] : []), ...this.fan]) {
      for (let i = 0; i < this.draws.length; i += 1) this.draws[i] = normal();
      this.gains.set(model.gains[setting.mode][setting.decoupled !== (craft === 1) ? 0 : 1]);
      this.frame(craft);
    }
    this.fan = this.fan.filter((craft) => !this.#lost(places[craft].x));
    this.trouble = this.#ended(before);
    if (this.trouble) {
      own.x.set(before);
      return false;
    }
    if (setting.ghost && this.#lost(places[1].x)) setting.ghost = false;
    this.latest = [...before, ...own.inputs, ...this.around];
    this.ticks += 1;
    return true;
  }
  #lost(x) {
    return !x.every(Number.isFinite) || (this.model.linear ? this.#leans(x) : x[this.place.z] >= 0.5 - this.model.trim.x[this.place.z]);
  }
  #leans(x) {
    return Math.max(Math.abs(x[this.place.phi]), Math.abs(x[this.place.theta])) > LEAN;
  }
  #ended(before) {
    const { x } = this.places[0], { place, model } = this;
    if (!x.every(Number.isFinite) || x.some((value, i) => Math.abs(value) > model.largest[i]))
      return "The simulation left the range in which the equations hold. Reset to fly again.";
    if (model.linear) return this.#leans(x) ? "Leans 60 deg, where a linear model tells nothing any more. Reset to fly again." : "";
    const sink = (x[place.z] - before[place.z]) / this.period;
    return x[place.z] > 0 && !model.ground ? `Touched the ground at ${sink.toFixed(1)} m/s. Reset to fly again.` : "";
  }
  // The reference row: sticks move what is held, or go through.
  #ask() {
    const { setting, model, target, period } = this, s = setting.sticks, row = new Array(10).fill(0);
    if (setting.mode === "raw") {
      this.#take();
      row[8] = s.yaw;
      row[9] = s.heave;
    } else {
      const height = target[2] - period * model.climb * s.heave;
      target[2] = model.linear ? height : Math.min(height, -0.2);
      target[3] += period * model.turn * s.yaw;
    }
    if (["raw", "held", "attitude"].includes(setting.mode)) [row[6], row[7]] = [s.roll, s.pitch];
    else {
      const ahead = model.speed * s.pitch, right = model.speed * s.roll;
      [row[4], row[5]] = [ahead, right];
      const c = Math.cos(target[3]), n = Math.sin(target[3]);
      target[0] += period * (c * ahead - n * right);
      target[1] += period * (n * ahead + c * right);
    }
    row.splice(0, 4, ...this.target);
    this.wanted.set(row);
  }
  #blow() {
    const wind = [...this.setting.wind];
    this.air = this.air?.map((state, i) => {
      const { step, noise, output } = this.model.gusts[i], shaken = state.map(normal);
      wind[i] += this.setting.gusts * output.reduce((sum, part, k) => sum + part * state[k], 0);
      return state.map((_, k) => step[k].reduce((sum, part, j) => sum + part * state[j] + noise[k][j] * shaken[j], 0));
    });
    this.around.set([...wind, this.setting.voltage]);
  }
  #add() {
    const { maneuver } = this, now = maneuver ? maneuver.shape[this.ticks - maneuver.begun] : undefined;
    if (now === undefined) this.maneuver = null;
    this.added.set(now === undefined ? new Array(this.added.length).fill(0) : maneuver.vector.map((part) => part * now));
  }

  // ---- looking
  crafts() {
    const told = (craft) => {
      const { x, inputs } = this.places[craft];
      return { x: [...x.slice(0, 12)], u: [...inputs], ...this.#pose(x, inputs) };
    };
    const { ghost, logged } = this.setting, { x, u } = this.model.trim;
    const flown = logged ? { logged: { x: this.#loggedNow(), u: [...u], ...this.#pose(x, u) } } : {};
    return { own: told(0), ...(ghost ? { ghost: told(1) } : {}), ...flown };
  }
  fanned() {
    if (!this.model.draws.length) return null;
    return { begun: this.fanBegun * this.period, x: this.model.draws.map((_, i) => (this.fan.includes(i + 2) ? [...this.places[i + 2].x.slice(0, 12)] : null)) };
  }
  // How rotors and bar stand, to first order about the hover: for the eye.
  #pose(x, u) {
    const { at, slopes, rotors, bar, tail } = this.model.pose, { trim } = this.model;
    const away = [...x].map((value, i) => value - trim.x[i]).concat([...u].map((value, i) => value - trim.u[i]));
    const flat = at.map((value, i) => value + slopes[i].reduce((sum, part, j) => sum + part * away[j], 0));
    const discs = Array.from({ length: rotors }, (_, i) => flat.slice(6 * i, 6 * i + 6)), rest = flat.slice(6 * rotors);
    return { rotors: discs, bar: bar ? rest.slice(0, 2) : null, tail: tail ? rest.slice(-2) : null };
  }
  // What the pilot must know of the flight as it is, "" for nothing; `air` where nobody else looks at its air speed.
  remark(air = true) {
    const { setting, model, place, target } = this, { x, inputs } = this.places[0], remarks = [];
    const off = Math.hypot(x[place.x] - target[0], x[place.y] - target[1]);
    if (setting.mode === "position" && off > HELD) {
      const ends = model.hello.inputs.filter(({ name, low, high }, i) => (inputs[i] <= low || inputs[i] >= high) && !model.held.includes(name));
      const why = ends.length ? `: ${ends.map(({ name }) => name).join(", ")} at the limit`
        : setting.wind.some(Boolean) ? ": the controller leans no more than it may, which is too little against this wind" : "";
      remarks.push(`The place is not held, it is ${off.toFixed(0)} m away${why}.`);
    }
    const speed = this.airSpeed();
    if (air && model.fastest !== null && speed > model.fastest) remarks.push(`Its air speed is ${speed.toFixed(1)} m/s: the card may be trusted up to ${model.fastest} m/s.`);
    return remarks.join(" ");
  }
  // Through the wind of the sliders, as `models/doubts.py` has it: velocity in body axes less the wind turned into them.
  airSpeed() {
    const { x } = this.places[0], { place } = this, at = (name) => x[place[name]], [n, e, d] = this.setting.wind;
    const [cf, sf, ct, st, cp, sp] = ["phi", "theta", "psi"].flatMap((name) => [Math.cos(at(name)), Math.sin(at(name))]);
    const ahead = ct * cp * n + ct * sp * e - st * d;
    const right = (sf * st * cp - cf * sp) * n + (sf * st * sp + cf * cp) * e + sf * ct * d;
    const down = (cf * st * cp + sf * sp) * n + (cf * st * sp - sf * cp) * e + cf * ct * d;
    return Math.hypot(at("u") - ahead, at("v") - right, at("w") - down);
  }
}
