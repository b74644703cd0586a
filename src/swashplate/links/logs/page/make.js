// Elements in one line: make("p", { class: "soft" }, "text", child).
const SVG = "http://www.w3.org/2000/svg";

function filled(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== undefined && value !== null && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export const make = (name, attributes = {}, ...children) => filled(document.createElement(name), attributes, children);
export const shape = (name, attributes = {}, ...children) => filled(document.createElementNS(SVG, name), attributes, children);
export const $ = (id) => document.getElementById(id);

export function colour(index) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--c${index % 8}`).trim();
}

export const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// Lines of the first, second, ... log.
export const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3]];

export function sample(style, dash = []) {
  return shape("svg", { viewBox: "0 0 32 8", "aria-hidden": "true" },
    shape("line", { x1: 0, y1: 4, x2: 32, y2: 4, stroke: style, "stroke-width": 3, "stroke-dasharray": dash.join(" ") }));
}

// Four digits that matter, without an exponent where none is needed.
export function short(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-4)) return value.toExponential(2);
  return size >= 1000 ? value.toFixed(0) : size >= 100 ? value.toFixed(1) : size >= 10 ? value.toFixed(2) : size >= 1 ? value.toFixed(3) : value.toFixed(4);
}
