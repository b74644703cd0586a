// Wheel, double click, shifted drag and two fingers: zoom and pan of the shared axis of time.
import { choose, measured } from "./marks.js";
import { look, say, seen, whole } from "./state.js";

const FASTEST = 0.0015;

export function gestures(plot) {
  const over = plot.over;
  over.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.shiftKey && !event.altKey && Math.abs(event.deltaX) < Math.abs(event.deltaY) && !event.metaKey) return; // the page scrolls
    event.preventDefault();
    const width = seen.high - seen.low;
    if (event.shiftKey && !event.ctrlKey) {
      const by = (event.deltaX || event.deltaY) * 0.001 * width;
      look(seen.low + by, seen.high + by, { remember: false });
      return;
    }
    const at = plot.posToVal(event.offsetX, "x"), factor = Math.exp(event.deltaY * FASTEST);
    look(at - (at - seen.low) * factor, at + (seen.high - at) * factor, { remember: false });
  }, { passive: false });
  over.addEventListener("dblclick", () => look(...whole()));
  let down = null;
  over.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
  over.addEventListener("click", (event) => {
    if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return; // it was dragged
    choose(plot.posToVal(event.clientX - over.getBoundingClientRect().left, "x"));
    say("marks");
  });
  let held = null;
  over.addEventListener("touchmove", (event) => {
    if (event.touches.length !== 2) return;
    event.preventDefault();
    const [a, b] = [...event.touches].map((touch) => touch.clientX - over.getBoundingClientRect().left).sort((x, y) => x - y);
    const size = over.clientWidth;
    held ??= { low: plot.posToVal(a, "x"), high: plot.posToVal(b, "x") };
    const slope = (held.high - held.low) / Math.max(20, b - a);
    look(held.low - slope * a, held.low + slope * (size - a), { remember: false });
  }, { passive: false });
  over.addEventListener("touchend", () => (held = null));
}

export function begin() {
  addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || measured() === null) return;
    choose(null);
    say("marks");
  });
}
