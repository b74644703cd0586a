// The page of `swash live`: it flies here; the server hears what was flown, records, estimates and identifies.
import { Flown } from "./flown.js";

const NOBODY = { notice: "", doubts: "", recording: null, recordings: [], job: null, frozen: "", estimates: [] };

export class Connection extends Flown {
  constructor({ heard }) {
    super({ heard });
    this.told = NOBODY;
    this.seen = "";
    this.rows = [];
    this.#open();
  }

  #open() {
    this.socket = new WebSocket(`ws${location.protocol === "https:" ? "s" : ""}://${location.host}/socket`);
    this.socket.onmessage = ({ data }) => this.#hear(JSON.parse(data));
    this.socket.onclose = () => {
      this.told = { ...NOBODY, estimates: this.told.estimates, doubts: "The server is not there: you fly on, and nothing is recorded." };
      setTimeout(() => this.#open(), 1500);
    };
  }

  #hear(message) {
    if (message.type !== "model") {
      this.told = message;
      return;
    }
    if (message.version === this.session) return; // it was away for a moment
    this.session = message.version;
    this.told = { ...this.told, estimates: message.model.hello.estimates.map(() => [null, null, null]) };
    this.begin(message.model, Uint8Array.from(atob(message.code), (char) => char.charCodeAt(0)), { goesOn: message.goes_on });
  }

  kept(row) {
    this.rows.push(this.session, this.flight.ticks, ...row);
  }

  more() {
    const { told, flight } = this;
    if (this.rows.length && this.socket.readyState === WebSocket.OPEN) this.socket.send(Float64Array.from(this.rows));
    this.rows = [];
    const { notice, doubts, ...rest } = told;
    return { ...rest, notice: (notice === this.seen ? "" : notice) || flight.remark(false) || doubts };
  }

  ask(type, fields) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ type, ...fields }));
  }

  // What the pilot has seen is not told again.
  quiet() {
    this.seen = this.told.notice;
  }
}
