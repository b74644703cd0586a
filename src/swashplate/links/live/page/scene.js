// The scene: the land, one or two helicopters with trails and shadows, and three cameras.
import * as THREE from "./vendor/three.module.min.js";
import { Fan } from "./fan.js";
import { Helicopter } from "./helicopter.js";
import { Land } from "./land.js";
import { Trail } from "./trail.js";

const COLORS = { own: 0xd55e00, ghost: 0x56b4e9, logged: 0x7a5195 };
const SOFTWARE = /swiftshader|llvmpipe|software/i;

// Asked of a context of its own: whether edges are smoothed is settled when the page's is made.
function drawnInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return false;
  const told = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return SOFTWARE.test(name);
}

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.software = drawnInSoftware(); // by the processor that also simulates: coarser pictures, edges unsmoothed
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !this.software, powerPreference: "high-performance" });
    if (this.software) { // colours as they are written: turning each pixel's from linear light costs as much as painting it
      THREE.ColorManagement.enabled = false;
      this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    }
    this.renderer.setPixelRatio(this.software ? 0.6 : Math.min(window.devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0xdbe8f2);
    this.scene.fog = new THREE.Fog(0xdbe8f2, 10, 100);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a9a7b, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(3, 8, -4);
    this.scene.add(sun);
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.01, 4000);
    this.world = new THREE.Group(); // north, east, down inside: turned so that up is up
    this.world.rotation.x = Math.PI / 2;
    this.scene.add(this.world);
    this.view = "chase";
    this.orbit = { turn: 0, lift: 0.28, zoom: 1 };
    this.heading = 0;
    this.crafts = {};
    this.size = 1;
    this.#orbitByHand();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  #orbitByHand() {
    let held = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      held = [event.clientX, event.clientY];
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      this.orbit.turn -= 0.008 * (event.clientX - held[0]);
      this.orbit.lift = Math.min(1.5, Math.max(0.02, this.orbit.lift + 0.006 * (event.clientY - held[1])));
      held = [event.clientX, event.clientY];
    });
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, () => (held = null));
    this.canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.orbit.zoom = Math.min(6, Math.max(0.35, this.orbit.zoom * Math.exp(0.001 * event.deltaY)));
    }, { passive: false });
  }

  // Another vehicle: everything that is drawn of the last one goes.
  show(picture) {
    for (const name of Object.keys(this.crafts)) this.#remove(name);
    this.fan?.remove();
    this.fan = null;
    this.picture = picture;
    this.size = picture.size;
    this.land?.remove();
    this.cell = picture.size < 0.4 ? 1 : picture.size < 2 ? 5 : 50;
    this.floor = picture.floor ?? 0; // down [m]: a log whose origin is the hover began on its ground, not in it
    this.grounded = picture.ground ?? true;
    this.land = new Land(this.scene, this);
  }

  #remove(name) {
    const craft = this.crafts[name];
    this.world.remove(craft.model.group, craft.trail.line, craft.shadow, craft.plumb);
    delete this.crafts[name];
  }

  #add(name) {
    const model = new Helicopter(this.picture, { ghost: name !== "own", color: COLORS[name] });
    const trail = new Trail(COLORS[name]);
    const shadow = new THREE.Mesh(
      new THREE.CircleGeometry(this.size, 24),
      new THREE.MeshBasicMaterial({ color: 0x44543f, transparent: true, opacity: 0.3, side: THREE.DoubleSide, depthWrite: false }),
    );
    const plumb = new THREE.Line(
      new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(0, 0, 1)]),
      new THREE.LineBasicMaterial({ color: 0x44543f, transparent: true, opacity: 0.4 }),
    );
    this.world.add(model.group, trail.line, shadow, plumb);
    this.crafts[name] = { model, trail, shadow, plumb };
  }

  clearTrails() {
    for (const craft of Object.values(this.crafts)) craft.trail.clear();
    this.fan?.clear();
  }

  // Body states of the drawn models at one more moment; `anew` where they begin again.
  leaveFan(rows, { anew = false } = {}) {
    this.fan ??= new Fan(this.world, this.size, rows.length);
    if (anew) this.fan.clear();
    this.fan.add(rows);
  }

  // `rows` are body states by name (of "fan" one of each drawn model), `moment` tells the discs; `elapsed` seconds of simulation since the last picture.
  draw(rows, moment, elapsed) {
    for (const name of Object.keys(COLORS)) {
      if (!rows[name]) {
        if (this.crafts[name]) this.#remove(name);
        continue;
      }
      if (!this.crafts[name]) this.#add(name);
      const { model, shadow, plumb } = this.crafts[name], x = rows[name];
      model.pose(x, moment[name], elapsed);
      shadow.position.set(x[0], x[1], this.floor - 0.002 * this.cell);
      plumb.position.set(x[0], x[1], x[2]);
      plumb.scale.z = Math.max(this.floor - x[2], 1e-3);
    }
    this.fan?.pose(rows.fan);
    this.#look(rows.own);
    this.renderer.render(this.scene, this.camera);
  }

  leaveTrail(name, x) {
    const craft = this.crafts[name];
    if (craft) craft.trail.add(x[0], x[1], x[2]);
  }

  #look(x) {
    const at = new THREE.Vector3(x[0], -x[2], x[1]), { turn, lift, zoom } = this.orbit;
    if (this.view === "above") {
      this.camera.position.set(at.x, at.y + 55 * this.size * zoom + 2, at.z);
      this.camera.up.set(1, 0, 0);
    } else if (this.view === "pilot") {
      this.camera.position.set(-26 * this.size * zoom, 1.7 + 3 * this.size, 4 * this.size);
      this.camera.up.set(0, 1, 0);
    } else {
      const gap = Math.atan2(Math.sin(x[8] - this.heading), Math.cos(x[8] - this.heading));
      this.heading += 0.08 * gap;
      const distance = 9 * this.size * zoom, around = this.heading + turn, flat = distance * Math.cos(lift);
      this.camera.position.set(
        at.x - flat * Math.cos(around), Math.max(at.y + distance * Math.sin(lift), this.grounded ? 0.1 * this.size - this.floor : -Infinity), at.z - flat * Math.sin(around),
      );
      this.camera.up.set(0, 1, 0);
    }
    this.camera.lookAt(at);
    this.land.around(at, this.camera.position);
  }
}
