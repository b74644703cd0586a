// Models that the flights cannot tell apart, flown from one place: a line and a mark of nose and arms each.
import * as THREE from "./vendor/three.module.min.js";
import { Trail } from "./trail.js";

const COLOR = 0x3a86b8;

export class Fan {
  constructor(world, size, count) {
    this.world = world;
    const arms = [[-0.6, 0], [1.2, 0], [0, -0.8], [0, 0.8]].map(([x, y]) => new THREE.Vector3(x * size, y * size, 0));
    this.geometry = new THREE.BufferGeometry().setFromPoints(arms);
    this.material = new THREE.LineBasicMaterial({ color: COLOR, transparent: true, opacity: 0.8 });
    this.members = Array.from({ length: count }, () => {
      const trail = new Trail(COLOR, 0.45), mark = new THREE.LineSegments(this.geometry, this.material);
      world.add(trail.line, mark);
      return { trail, mark };
    });
  }
  clear() {
    for (const { trail } of this.members) trail.clear();
  }
  // One more place of every line; a model that is lost has none.
  add(rows) {
    rows.forEach((x, i) => x && this.members[i].trail.add(x[0], x[1], x[2]));
  }
  pose(rows) {
    this.members.forEach(({ mark }, i) => {
      const x = rows?.[i];
      mark.visible = Boolean(x);
      if (!x) return;
      mark.position.set(x[0], x[1], x[2]);
      mark.rotation.set(x[6], x[7], x[8], "ZYX");
    });
  }
  remove() {
    for (const { trail, mark } of this.members) this.world.remove(trail.line, mark);
  }
}
