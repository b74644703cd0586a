// Everything done on the page as command line and Python, newest first, to copy.
import { $, make } from "./make.js";

const done = [];
const MOST = 30;

async function copy(text, button) {
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
  } catch {
    button.textContent = "Press Ctrl-C";
    const range = document.createRange();
    range.selectNodeContents(button.parentElement.querySelector("pre"));
    getSelection().removeAllRanges();
    getSelection().addRange(range);
  }
  setTimeout(() => (button.textContent = "Copy"), 1500);
}

export function lines(what, text) {
  return text && make("div", { class: "lines" }, make("span", {}, what),
    make("button", { onclick: (event) => copy(text, event.target) }, "Copy"), make("pre", { "data-code": what }, text));
}

export function block(code) {
  return make("div", { class: "code" }, make("h3", {}, code.title), lines("Command line", code.shell), lines("Python", code.python));
}

function show() {
  $("code").replaceChildren(
    make("h2", {}, "The same without this page"),
    done.length ? "" : make("p", { class: "soft" }, "What you do here appears as commands and lines of Python."),
    ...done.map(block),
  );
}

// An action of the same title replaces the earlier one.
export function note(code) {
  if (!code) return;
  const old = done.findIndex((other) => other.title === code.title);
  if (old >= 0) done.splice(old, 1);
  done.unshift(code);
  done.length = Math.min(done.length, MOST);
  show();
}

export const begin = show;
