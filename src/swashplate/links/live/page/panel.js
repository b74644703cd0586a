// Switches, sliders and buttons: what they say to the server, and how they stand by what the server says.
const $ = (id) => document.getElementById(id);
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

// Only what differs is written: every change of the page is laid out and painted anew.
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function press(button, on) {
  if (button.getAttribute("aria-pressed") !== String(on)) button.setAttribute("aria-pressed", on);
}

export class Panel {
  constructor(say, { view }) {
    this.say = say;
    this.now = null;
    this.touched = new Map(); // controls that a hand has just moved are not moved back by the server
    this.slid = new Map();
    for (const button of document.querySelectorAll("[data-mode]"))
      button.onclick = () => say("mode", { value: button.dataset.mode });
    for (const name of ["decoupled", "ghost", "logged", "bar"])
      $(name).onchange = () => {
        this.touched.set(name, performance.now());
        say(name, { value: $(name).checked });
      };
    for (const button of document.querySelectorAll("[data-maneuver]"))
      button.onclick = () => say("maneuver", { kind: button.dataset.maneuver, axis: $("axis").value, size: Number($("size").value) });
    for (const button of document.querySelectorAll("[data-view]"))
      button.onclick = () => {
        view(button.dataset.view);
        for (const other of document.querySelectorAll("[data-view]")) press(other, other === button);
      };
    const blow = () => say("wind", { north: Number($("north").value), east: Number($("east").value), down: 0 });
    this.#slider("north", " m/s", blow);
    this.#slider("east", " m/s", blow);
    this.#slider("gusts", " m/s", (value) => say("gusts", { value }));
    this.#slider("voltage", " V", (value) => say("voltage", { value }));
    $("pause").onclick = () => this.#pause();
    $("step").onclick = () => say("step");
    $("reset").onclick = () => say("reset");
    $("slower").onclick = () => this.#faster(-1);
    $("faster").onclick = () => this.#faster(1);
    $("record").onclick = () => say("record", { value: this.now?.recording === null });
    $("identify").onclick = () => say("identify", { recording: Number($("which").value), how: $("how").value });
    $("learn").onclick = () => say("learn");
    $("stop-identifying").onclick = () => say("stop_identifying");
  }

  #slider(id, unit, changed) {
    const input = $(id);
    const show = () => write(input.nextElementSibling, Number(input.value).toFixed(1) + unit);
    input.oninput = () => {
      this.touched.set(id, performance.now());
      this.slid.delete(id);
      show();
      changed(Number(input.value));
    };
    input.show = show;
  }

  /** Nobody has moved this control lately: the server may. */
  #still(id) {
    return performance.now() - (this.touched.get(id) ?? -1e9) > 800;
  }

  #pause() {
    this.say("pause", { value: Boolean(this.now?.runs) });
  }

  #faster(by) {
    const place = SPEEDS.indexOf(this.now?.speed ?? 1);
    const value = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, (place < 0 ? 3 : place) + by))];
    this.say("speed", { value });
  }

  // A key that is no stick; true where it meant something.
  shortcut(code) {
    const does = {
      Space: () => this.#pause(),
      Period: () => this.say("step"),
      KeyR: () => this.say("reset"),
      Minus: () => this.#faster(-1),
      Equal: () => this.#faster(1),
      NumpadAdd: () => this.#faster(1),
      NumpadSubtract: () => this.#faster(-1),
    }[code];
    if (!does || (code === "Space" && document.activeElement?.tagName === "BUTTON")) return false; // it presses that
    does();
    return true;
  }

  hello(hello) {
    $("voltage-row").hidden = !hello.voltages;
    for (const row of document.querySelectorAll(".wind")) row.hidden = !hello.wind; // what the equations do not have
    $("air").hidden = !hello.wind && !hello.voltages;
    $("bar").parentElement.hidden = !hello.bar;
    $("logged").parentElement.hidden = !hello.logged;
    for (const button of document.querySelectorAll("[data-mode]")) button.hidden = !hello.modes.includes(button.dataset.mode);
    for (const name of ["decoupled", "ghost"]) $(name).parentElement.hidden = !hello.decoupling; // both would be alike
    for (const option of $("how").options) option.hidden = option.disabled = !hello.hows.includes(option.value);
    if (!hello.hows.includes($("how").value)) $("how").value = hello.hows[0];
    $("learn-row").hidden = !hello.learns;
    $("about").hidden = !hello.about;
    $("about").textContent = hello.about;
    $("fan").hidden = !hello.fan;
    $("fan").textContent = `Thin lines and shaded: ${hello.fan} models that the fit cannot tell from this one, under the same sticks, anew every ${hello.fan_seconds} s.`;
    if (hello.voltages) [$("voltage").min, $("voltage").max] = hello.voltages;
    $("controller").textContent = `Controller: ${hello.controller}, ${hello.rate.toFixed(0)} Hz.`;
    $("sensors").textContent = `The pilot reads ${hello.sensors}.`;
    $("trust").textContent = `Where the card may be trusted: ${hello.trust}`;
    $("folder").textContent = `Recordings and reports go to the folder ${hello.folder}.`;
    $("folder").hidden = !hello.folder; // a page that flies by itself saves to downloads
  }

  gamepad(name) {
    const text = name ? `Gamepad: ${name}` : "No gamepad: keyboard and the sticks on the screen fly.";
    write($("gamepad"), text);
  }

  show(now) {
    const { setting } = now;
    for (const button of document.querySelectorAll("[data-mode]"))
      press(button, button.dataset.mode === setting.mode);
    for (const name of ["decoupled", "ghost", "logged", "bar"])
      if (this.#still(name) && $(name).checked !== setting[name]) $(name).checked = setting[name];
    const values = { north: setting.wind[0], east: setting.wind[1], gusts: setting.gusts, voltage: setting.voltage };
    for (const [id, value] of Object.entries(values)) {
      if (this.#still(id) && this.slid.get(id) !== value) {
        $(id).value = value;
        this.slid.set(id, value);
      }
      $(id).show();
    }
    write($("pause"), now.runs ? "Pause" : "Go on");
    write($("speed"), `${now.speed}×`);
    write($("maneuver"), now.maneuver > 0 ? `${now.maneuver.toFixed(0)} s left` : "");
    write($("record"), now.recording === null ? "Record" : "Stop and save");
    $("record").classList.toggle("on", now.recording !== null);
    write($("recorded"), now.recording === null ? "" : `${now.recording.toFixed(0)} s`);
    this.#recordings(now);
    const words = now.trouble || now.notice;
    $("trouble").hidden = !words;
    write($("trouble"), words);
    const state = [
      `${now.t.toFixed(1)} s`, now.runs ? "" : "paused", `busy ${(100 * now.busy).toFixed(0)} %`,
      now.skipped >= 0.1 ? `${now.skipped.toFixed(1)} s lost` : "",
      now.frozen ? `estimate stands still: ${now.frozen}` : "",
    ];
    write($("state"), state.filter(Boolean).join(" · "));
  }

  #recordings({ recordings, job }) {
    $("identify-row").hidden = !recordings.length;
    const which = $("which");
    if (which.options.length !== recordings.length) {
      which.replaceChildren(...recordings.map(([n, seconds]) => new Option(`recording ${n}, ${seconds.toFixed(0)} s`, n)));
      which.value = recordings.at(-1)?.[0] ?? "";
    }
    const running = job?.[1] === "running";
    $("identify").disabled = running;
    $("stop-identifying").hidden = !running;
    const key = JSON.stringify(job);
    if (key === this.told) return;
    this.told = key;
    $("job").replaceChildren();
    if (!job) return;
    const [n, state, words, seconds, doing, share, left] = job;
    if (running) {
      const rest = left === null ? "" : `, about ${left} s left`;
      $("job").textContent = `identifying recording ${n}: ${doing || "starting"}, ${seconds} s${rest} `;
      const bar = document.createElement("progress");
      if (share !== null) bar.value = share;
      $("job").append(bar);
    } else $("job").textContent = `recording ${n}: ${state === "done" ? `identified in ${seconds} s. ` : "failed. "}${words}`;
    if (state === "done") {
      const link = document.createElement("a");
      Object.assign(link, { href: `/report/${n}`, target: "_blank", rel: "noopener", textContent: " Open the report" });
      $("job").append(link);
    }
  }
}
