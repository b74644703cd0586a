// A page without a server: the model flies here, as WebAssembly, and says what the server of `swash live` says.
import { Flight } from "./flight.js";

const UPDATES = 1000 / 30, LONGEST = 0.25; // ms between what is told; s of flight that one turn may catch up with
const FIELD = (name, unit) => (unit ? `${name} [${unit}]` : name);

export class Connection {
  constructor({ heard }) {
    this.heard = heard;
    this.model = JSON.parse(document.getElementById("model").textContent);
    this.speed = 1;
    this.runs = true;
    this.busy = 0;
    this.rows = null;
    this.notice = "";
    this.#begin();
  }

  async #begin() {
    const module = await WebAssembly.compile(window.swashBytes.flight);
    this.flight = new Flight(await WebAssembly.instantiate(module, {}), this.model);
    this.heard({ type: "hello", version: 1, ...this.model.hello });
    this.last = performance.now();
    setInterval(() => this.#turn(), UPDATES);
  }

  // Time that a hidden page has slept through is not flown.
  #turn() {
    const at = performance.now();
    const due = this.runs ? Math.min((at - this.last) / 1000, LONGEST) * this.speed : 0;
    this.last = at;
    this.left = (this.left ?? 0) + due;
    const { period } = this.flight;
    for (; this.left >= period; this.left -= period) this.#step();
    this.busy = 0.95 * this.busy + (0.05 * (performance.now() - at)) / UPDATES;
    this.heard(this.#moment());
  }

  #step() {
    if (!this.flight.step()) return;
    this.rows?.push([(this.rows.length * this.flight.period).toFixed(4), ...this.flight.latest]);
  }

  #moment() {
    const { flight, speed, runs } = this;
    const { setting } = flight;
    return {
      type: "moment", version: 1, t: flight.ticks * flight.period, ...flight.crafts(), fan: flight.fanned(), target: [...flight.target],
      stick: setting.number, trouble: flight.trouble, notice: this.notice || flight.remark(), runs, speed, steps: flight.ticks, late: 0,
      skipped: 0, busy: this.busy, maneuver: flight.maneuverLeft, recording: this.rows ? this.rows.length * flight.period : null,
      recordings: [], job: null, frozen: "", estimates: [],
      setting: { ...setting, bar: false },
    };
  }

  say(type, fields = {}) {
    const { flight } = this;
    if (!flight) return;
    const value = fields.value;
    if (type !== "stick") this.notice = "";
    const does = {
      stick: () => flight.steer(fields),
      mode: () => flight.setMode(value),
      decoupled: () => (flight.setting.decoupled = value),
      ghost: () => flight.setGhost(value),
      wind: () => (flight.setting.wind = [fields.north, fields.east, fields.down]),
      gusts: () => flight.setGusts(value),
      voltage: () => (flight.setting.voltage = value),
      maneuver: () => flight.flyManeuver(fields.kind, fields.axis, fields.size),
      pause: () => (this.runs = !value),
      step: () => {
        this.runs = false;
        this.#step();
      },
      speed: () => (this.speed = value),
      reset: () => flight.reset(),
      record: () => (value ? (this.rows = []) : this.#save()),
    }[type];
    does?.();
  }

  // What was flown, as a table that `swash inspect` reads.
  #save() {
    const { rows, model } = this;
    this.rows = null;
    if (!rows?.length) return;
    const named = [["time", "s"], ...model.states, ...model.hello.inputs.map(({ name, unit }) => [name, unit]),
      ["wind_north", "m/s"], ["wind_east", "m/s"], ["wind_down", "m/s"], ["voltage", "V"]];
    const text = [named.map(([name, unit]) => FIELD(name, unit === "1" ? "" : unit)).join(","), ...rows.map((row) => row.join(","))].join("\n");
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([`${text}\n`], { type: "text/csv" }));
    link.download = `${model.name}.csv`;
    link.click();
    URL.revokeObjectURL(link.href);
    this.notice = `${link.download} is saved: ${(rows.length * this.flight.period).toFixed(1)} s, simulated.`;
  }
}
