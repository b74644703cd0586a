// The one WebSocket: what the server says goes to `heard`; it is opened again when it is lost.
export class Connection {
  constructor({ heard, lost }) {
    this.heard = heard;
    this.lost = lost;
    this.#open();
  }
  #open() {
    this.socket = new WebSocket(`ws${location.protocol === "https:" ? "s" : ""}://${location.host}/socket`);
    this.socket.onmessage = (event) => this.heard(JSON.parse(event.data));
    this.socket.onclose = () => {
      this.lost();
      setTimeout(() => this.#open(), 1500);
    };
  }
  say(type, fields = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ type, ...fields }));
  }
}
