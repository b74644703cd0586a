// The page before there is a log: where to drop files, and what comes with the package to try it on.
import { refresh } from "./log_list.js";
import { $, make } from "./make.js";
import { post } from "./server.js";
import { attempt } from "./trouble.js";

const open = attempt(async (file) => {
  $("state").textContent = `reading ${file} …`;
  try {
    await post("/example", { file });
  } finally {
    $("state").textContent = "";
  }
  await refresh();
});

// The tab is opened by the click itself: a browser lets nothing be opened later.
const fly = attempt(async (card) => {
  const tab = window.open("about:blank"), words = card.querySelector("span"), before = words.textContent;
  card.disabled = true;
  words.textContent = "Starting: the first time it compiles …";
  try {
    const { address } = await post("/fly", {});
    if (tab) tab.location.replace(address);
    words.replaceChildren(...(tab ? [before] : ["It flies: ", make("a", { href: address, target: "_blank", rel: "noopener" }, address)]));
  } catch (error) {
    tab?.close();
    words.textContent = before;
    throw error;
  } finally {
    card.disabled = false;
  }
});

const card = (title, words, act, name) => {
  const made = make("button", { class: "try", "data-try": name, onclick: () => act(made) }, make("b", {}, title), make("span", {}, words));
  return made;
};

export function offer(examples) {
  $("cards").replaceChildren(
    ...examples.map(({ file, title, words }) => card(title, words, () => open(file), file)),
    card("Fly the Raptor", "A 50-size helicopter in real time, by keyboard, gamepad or touch.", fly, "fly"),
  );
}

export function begin() {
  $("pick").onclick = () => $("files").click();
}
