// When the next picture is due: at every frame with a graphics card; where the processor that simulates also draws, ten a
// second, and fewer while steps of the simulation come late.
const FASTEST = 100, SLOWEST = 400; // ms between pictures
const WINDOW = 100, MUCH = 0.005; // steps that are looked at, and the share of them that may be late
const STEPPED = 33; // ms between looks at the sticks

export class Pace {
  constructor(software) {
    this.software = software;
    this.interval = software ? FASTEST : 0;
    this.drawn = -1e9;
    this.seen = null;
  }
  // What the server counts, at every update.
  told({ steps, late }) {
    if (!this.seen || steps < this.seen.steps) this.seen = { steps, late };
    const done = steps - this.seen.steps;
    if (!this.software || done < WINDOW) return;
    const share = (late - this.seen.late) / done;
    this.interval = Math.min(SLOWEST, Math.max(FASTEST, share > MUCH ? 1.5 * this.interval : 0.97 * this.interval));
    this.seen = { steps, late };
  }
  // True once each time a picture is due.
  due(at) {
    if (at - this.drawn < this.interval) return false;
    this.drawn = at;
    return true;
  }
  // Calls back at every frame, or, where frames cost the simulation, as often as sticks have to be read.
  run(frame) {
    const again = (at) => {
      if (this.software) setTimeout(() => again(performance.now()), STEPPED);
      else requestAnimationFrame(again);
      frame(at);
    };
    requestAnimationFrame(again);
  }
}
