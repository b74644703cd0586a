// Dark or light: the system's, until the button says otherwise.
import { $ } from "./make.js";
import { say } from "./state.js";

const system = matchMedia("(prefers-color-scheme: dark)");
let chosen = null;
try {
  chosen = localStorage.getItem("swash-theme");
} catch {
  chosen = null; // a browser that keeps nothing
}

function show() {
  const theme = chosen ?? (system.matches ? "dark" : "light");
  document.documentElement.dataset.theme = theme;
  $("theme").textContent = theme === "dark" ? "Light" : "Dark";
  say("theme");
}

export function begin() {
  system.addEventListener("change", show);
  $("theme").onclick = () => {
    chosen = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    try {
      localStorage.setItem("swash-theme", chosen);
    } catch {
      // it lasts until the page is closed
    }
    show();
  };
  show();
}
