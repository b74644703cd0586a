// A page without a server: the model lies in the file, and what is recorded is saved to the downloads.
import { Flown } from "./flown.js";

const FIELD = (name, unit) => (unit ? `${name} [${unit}]` : name);

export class Connection extends Flown {
  constructor({ heard }) {
    super({ heard });
    this.rows = null;
    const { flight, log } = window.swashBytes;
    this.begin(JSON.parse(document.getElementById("model").textContent), flight, { logged: log ? new Float32Array(log) : null });
  }

  kept(row) {
    this.rows?.push([(this.rows.length * this.flight.period).toFixed(4), ...row]);
  }

  more() {
    return { notice: this.notice || this.flight.remark(), recording: this.rows ? this.rows.length * this.flight.period : null };
  }

  ask(type, { value }) {
    if (type !== "record") return;
    if (value) this.rows ??= [];
    else this.#save();
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
