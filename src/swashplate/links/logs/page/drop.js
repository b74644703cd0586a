// Files that are dropped onto the page or chosen: sent in pieces, then read by the server.
import { $ } from "./make.js";
import { upload } from "./server.js";
import { refresh } from "./log_list.js";
import { trouble } from "./trouble.js";

let limits = { largest: 1 << 30, piece: 4 << 20 };

export function allow(told) {
  limits = { largest: told.largest, piece: told.piece };
}

async function take(files) {
  trouble(null);
  for (const file of files) {
    try {
      const share = (part) => {
        $("state").textContent = part < 1 ? `${file.name}: ${Math.round(100 * part)} % here` : `reading ${file.name} …`;
        if (part >= 1) setTimeout(refresh, 150); // it stands in the list while it is being read
      };
      share(0);
      await upload(file, limits.piece, share);
      $("state").textContent = "";
    } catch (error) {
      $("state").textContent = "";
      trouble({ words: `${file.name}: ${error.words ?? error}` });
    }
    await refresh();
  }
}

export function begin() {
  $("files").onchange = () => {
    take([...$("files").files]);
    $("files").value = "";
  };
  $("choose").onkeydown = (event) => ["Enter", " "].includes(event.key) && $("files").click();
  let inside = 0;
  addEventListener("dragenter", (event) => {
    event.preventDefault();
    inside += 1;
    $("dropping").hidden = false;
  });
  addEventListener("dragleave", () => {
    inside -= 1;
    if (inside <= 0) $("dropping").hidden = true;
  });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    inside = 0;
    $("dropping").hidden = true;
    if (event.dataTransfer?.files.length) take([...event.dataTransfer.files]);
  });
}
