// What went wrong, in words, at the top of the page until it is clicked away.
import { $ } from "./make.js";

export function trouble(error) {
  $("trouble").hidden = !error;
  $("trouble").textContent = error ? (error.words ?? error.message ?? String(error)) : "";
}

export function begin() {
  $("trouble").title = "click to close";
  $("trouble").onclick = () => trouble(null);
}

// An action whose refusal is shown.
export const attempt = (does) => async (...given) => {
  try {
    return await does(...given);
  } catch (error) {
    trouble(error);
    return undefined;
  }
};
