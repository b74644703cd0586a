// When the next picture is due: at every frame with a graphics card; where the processor draws, ten a second, and fewer
// where that takes it more than a third of the time.
const FASTEST = 100, SLOWEST = 400; // ms between pictures
const STEPPED = 33; // ms between looks at the sticks

export class Pace {
  constructor(software) {
    this.software = software;
    this.interval = software ? FASTEST : 0;
    this.drawn = -1e9;
  }
  // A picture has taken so long [ms].
  took(spent) {
    if (this.software) this.interval = Math.min(SLOWEST, Math.max(FASTEST, 0.8 * this.interval + 0.6 * spent));
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
