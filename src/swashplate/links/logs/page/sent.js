// A log that was sent as a page: as `swash open` shows it, with its fit first where it has one.
import { begin_with } from "./identify.js";
import { jobs } from "./kept.js";
import "./open.js";
import { ready } from "./state.js";

document.querySelector("#spectrum .soft").textContent = "Of the whole log.";
const [number] = Object.keys(jobs), [log] = ready();
if (number !== undefined) await begin_with(log, log.sweeps[number]);
document.documentElement.dataset.sent = "yes";
