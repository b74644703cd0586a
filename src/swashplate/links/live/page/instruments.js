// Artificial horizon and numbers.
const DEG = 180 / Math.PI;
const SVG = "http://www.w3.org/2000/svg";

function element(name, attributes, parent) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent.append(made);
  return made;
}

export class Instruments {
  constructor(home) {
    const svg = element("svg", { viewBox: "-50 -50 100 100", role: "img", "aria-label": "artificial horizon" }, home);
    const clip = element("clipPath", { id: "round" }, element("defs", {}, svg));
    element("circle", { r: 47 }, clip);
    const inside = element("g", { "clip-path": "url(#round)" }, svg);
    this.ball = element("g", {}, inside);
    element("rect", { x: -120, y: -240, width: 240, height: 240, fill: "#56b4e9" }, this.ball);
    element("rect", { x: -120, y: 0, width: 240, height: 240, fill: "#8c6b4a" }, this.ball);
    for (let pitch = -40; pitch <= 40; pitch += 10)
      element("line", { x1: pitch ? -12 : -60, x2: pitch ? 12 : 60, y1: -1.2 * pitch, y2: -1.2 * pitch, stroke: "#fff", "stroke-width": pitch ? 0.8 : 1.4 }, this.ball);
    element("path", { d: "M-26 0h14l5 6h14l5-6h14", fill: "none", stroke: "#111", "stroke-width": 2.4 }, svg);
    element("circle", { r: 47, fill: "none", stroke: "#333", "stroke-width": 2 }, svg);
    this.list = document.createElement("dl");
    home.append(this.list);
    this.shown = new Map();
  }
  number(name, text) {
    let cell = this.shown.get(name);
    if (!cell) {
      const term = document.createElement("dt");
      term.textContent = name;
      cell = document.createElement("dd");
      this.list.append(term, cell);
      this.shown.set(name, cell);
    }
    if (cell.textContent !== text) cell.textContent = text;
  }
  lean({ x }) {
    const leant = `rotate(${(-DEG * x[6]).toFixed(1)}) translate(0 ${(1.2 * DEG * x[7]).toFixed(1)})`;
    if (this.leant !== leant) this.ball.setAttribute("transform", (this.leant = leant));
  }
  show(craft, around, rpm = true) {
    const [, , z, u, v, w, phi, theta, psi] = craft.x;
    const climb = u * Math.sin(theta) - Math.cos(theta) * (v * Math.sin(phi) + w * Math.cos(phi));
    this.number("height", `${(-z).toFixed(2)} m`);
    this.number("climb", `${climb.toFixed(2)} m/s`);
    this.number("speed", `${Math.hypot(u, v, w).toFixed(2)} m/s`);
    this.number("heading", `${((Math.round(DEG * psi) % 360) + 360) % 360}°`);
    if (rpm) this.number("rotor", craft.rotors.map((rotor) => `${((30 / Math.PI) * rotor[2]).toFixed(0)}`).join(" / ") + " rpm");
    if (around) this.number("battery", around);
  }
}
