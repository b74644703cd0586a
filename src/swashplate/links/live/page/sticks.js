// Four axes from keyboard, gamepad and two sticks on the screen; whichever is deflected most wins.
const AXES = ["roll", "pitch", "yaw", "heave"];
const KEYS = {
  ArrowLeft: ["roll", -1], ArrowRight: ["roll", 1], ArrowUp: ["pitch", 1], ArrowDown: ["pitch", -1],
  KeyA: ["yaw", -1], KeyD: ["yaw", 1], KeyW: ["heave", 1], KeyS: ["heave", -1],
};
const DEAD = 0.06, RAMP = 4; // share of the travel; full deflections per second
const zero = () => ({ roll: 0, pitch: 0, yaw: 0, heave: 0 });
const limited = (value) => Math.min(1, Math.max(-1, value));

class ScreenStick {
  constructor(home, across, along) {
    this.axes = [across, along];
    this.value = [0, 0];
    this.pad = document.createElement("div");
    this.pad.className = "stick";
    this.pad.setAttribute("role", "application");
    this.pad.setAttribute("aria-label", `stick: ${across} and ${along}`);
    this.knob = document.createElement("i");
    this.pad.append(this.knob);
    const left = document.createElement("small");
    left.textContent = `${along} ↕ ${across} ↔`;
    this.pad.append(left);
    home.append(this.pad);
    let holder = null;
    const move = (event) => {
      const box = this.pad.getBoundingClientRect(), r = box.width / 2;
      this.set(limited((event.clientX - box.left - r) / (0.8 * r)), limited((box.top + r - event.clientY) / (0.8 * r)));
    };
    this.pad.addEventListener("pointerdown", (event) => {
      holder = event.pointerId;
      this.pad.setPointerCapture(holder);
      event.preventDefault();
      move(event);
    });
    this.pad.addEventListener("pointermove", (event) => event.pointerId === holder && move(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"])
      this.pad.addEventListener(end, (event) => {
        if (event.pointerId !== holder) return;
        holder = null;
        this.set(0, 0);
      });
  }
  set(across, along) {
    this.value = [across, along];
    this.show(across, along);
  }
  show(across, along) {
    if (this.shown === `${across} ${along}`) return;
    this.shown = `${across} ${along}`;
    this.knob.style.transform = `translate(${40 * across}%, ${-40 * along}%)`;
  }
}

export class Sticks {
  constructor(home, { onShortcut = () => {} } = {}) {
    this.left = new ScreenStick(home, "yaw", "heave");
    this.right = new ScreenStick(home, "roll", "pitch");
    this.held = new Set();
    this.keys = zero();
    this.scripted = null; // of tests
    this.gamepad = "";
    const typing = (event) => /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "range" && event.target.type !== "checkbox";
    window.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || typing(event)) return;
      if (KEYS[event.code]) {
        this.held.add(event.code);
        event.preventDefault();
      } else if (onShortcut(event.code)) event.preventDefault();
    });
    window.addEventListener("keyup", (event) => this.held.delete(event.code));
    window.addEventListener("blur", () => this.held.clear());
    document.addEventListener("visibilitychange", () => this.held.clear());
  }

  #pads() {
    const found = zero();
    this.gamepad = "";
    // A browser without the API, or a page that may not use it, has none.
    const pads = navigator.getGamepads ? [...navigator.getGamepads()].filter((pad) => pad && pad.connected) : [];
    if (!pads.length) return found;
    const [yaw = 0, heave = 0, roll = 0, pitch = 0] = pads[0].axes;
    this.gamepad = pads[0].id;
    const dead = (value) => (Math.abs(value) < DEAD ? 0 : (value - Math.sign(value) * DEAD) / (1 - DEAD));
    return { yaw: dead(yaw), heave: dead(-heave), roll: dead(roll), pitch: dead(-pitch) };
  }

  // The axes now, after `elapsed` seconds.
  read(elapsed) {
    const wanted = zero();
    for (const code of this.held) wanted[KEYS[code][0]] += KEYS[code][1];
    for (const axis of AXES) {
      const gap = wanted[axis] - this.keys[axis], step = RAMP * elapsed;
      this.keys[axis] += Math.abs(gap) <= step ? gap : Math.sign(gap) * step;
    }
    const screen = zero();
    for (const stick of [this.left, this.right]) stick.axes.forEach((axis, i) => (screen[axis] = stick.value[i]));
    const sources = [this.keys, this.#pads(), screen, this.scripted ?? zero()], now = zero();
    for (const axis of AXES)
      for (const source of sources) if (Math.abs(source[axis]) > Math.abs(now[axis])) now[axis] = limited(source[axis]);
    this.left.show(now.yaw, now.heave);
    this.right.show(now.roll, now.pitch);
    return now;
  }
}
