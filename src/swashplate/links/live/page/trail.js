// A line that grows behind what flies.
import * as THREE from "./vendor/three.module.min.js";

const TRAIL = 900;

export class Trail {
  constructor(color, opacity = 1) {
    this.points = new Float32Array(3 * TRAIL);
    this.count = 0;
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(this.points, 3));
    this.line = new THREE.Line(this.geometry, new THREE.LineBasicMaterial({ color, opacity, transparent: opacity < 1 }));
    this.line.frustumCulled = false;
    this.clear();
  }
  clear() {
    this.count = 0;
    this.geometry.setDrawRange(0, 0);
  }
  add(x, y, z) {
    if (this.count === TRAIL) {
      this.points.copyWithin(0, 3);
      this.count -= 1;
    }
    this.points.set([x, y, z], 3 * this.count);
    this.count += 1;
    this.geometry.setDrawRange(0, this.count);
    this.geometry.attributes.position.needsUpdate = true;
  }
}
