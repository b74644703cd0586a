// A helicopter from the numbers of its card, in body axes: x forward, y right, z down.
import * as THREE from "./vendor/three.module.min.js";

const UP = new THREE.Vector3(0, 1, 0);

function material(color, ghost, more = {}) {
  return new THREE.MeshLambertMaterial({ color, transparent: ghost, opacity: ghost ? 0.35 : 1, ...more });
}

function tube(from, to, radius, look) {
  const a = new THREE.Vector3(...from), b = new THREE.Vector3(...to);
  const made = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, a.distanceTo(b), 8), look);
  made.position.copy(a).add(b).multiplyScalar(0.5);
  made.quaternion.setFromUnitVectors(UP, b.sub(a).normalize());
  return made;
}

function blades(count, radius, chord, look) {
  const group = new THREE.Group();
  for (let i = 0; i < count; i++) {
    const arm = new THREE.Group();
    const blade = new THREE.Mesh(new THREE.BoxGeometry(radius, chord, 0.012 * radius), look);
    blade.position.x = radius / 2;
    arm.add(blade);
    arm.rotation.z = (2 * Math.PI * i) / count;
    group.add(arm);
  }
  return merged(group);
}

function disc(radius, color, ghost) {
  const look = new THREE.MeshBasicMaterial({
    color, transparent: true, opacity: ghost ? 0.1 : 0.22, side: THREE.DoubleSide, depthWrite: false,
  });
  return new THREE.Mesh(new THREE.CircleGeometry(radius, 40), look);
}

// One mesh of all that hangs in a group, each part in its own colour: a picture costs by the number of meshes.
function merged(group, look = THREE.MeshLambertMaterial) {
  group.updateMatrixWorld(true);
  const out = group.matrixWorld.clone().invert(), positions = [], normals = [], colors = [];
  let ghost = {};
  group.traverse((part) => {
    if (!part.isMesh) return;
    const geometry = part.geometry.toNonIndexed().applyMatrix4(part.matrixWorld).applyMatrix4(out), { r, g, b } = part.material.color;
    positions.push(...geometry.attributes.position.array);
    normals.push(...geometry.attributes.normal.array);
    for (let i = 0; i < geometry.attributes.position.count; i += 1) colors.push(r, g, b);
    ghost = { transparent: part.material.transparent, opacity: part.material.opacity };
  });
  const geometry = new THREE.BufferGeometry();
  for (const [name, values] of Object.entries({ position: positions, normal: normals, color: colors }))
    geometry.setAttribute(name, new THREE.Float32BufferAttribute(values, 3));
  return new THREE.Mesh(geometry, new look({ vertexColors: true, ...ghost }));
}

// A force, from where it acts.
class Arrow {
  constructor(color, scale) {
    this.scale = scale;
    const parts = new THREE.Group(), look = new THREE.MeshBasicMaterial({ color });
    const head = new THREE.Mesh(new THREE.ConeGeometry(0.04, 0.18, 5), look);
    head.position.y = 0.91;
    parts.add(tube([0, 0, 0], [0, 0.82, 0], 0.006, look), head);
    this.mesh = merged(parts, THREE.MeshBasicMaterial);
    this.direction = new THREE.Vector3();
  }
  show(fx, fy, fz) {
    this.direction.set(fx, fy, fz);
    const length = this.direction.length() * this.scale;
    this.mesh.visible = length > 1e-6;
    if (!this.mesh.visible) return;
    this.mesh.scale.setScalar(length);
    this.mesh.quaternion.setFromUnitVectors(UP, this.direction.normalize());
  }
}

export class Helicopter {
  constructor(picture, { ghost = false, color = 0xd55e00 } = {}) {
    this.picture = picture;
    this.group = new THREE.Group();
    this.group.rotation.order = "ZYX";
    this.phases = picture.rotors.map(() => 0);
    this.tailPhase = 0;
    const R = picture.size, per = (1.6 * R) / picture.weight;
    const paint = material(color, ghost), dark = material(0x333a40, ghost);
    const coaxial = picture.tail === null;

    const body = new THREE.Group();
    // What has no rotors says its parts; a fuselage is two balls, over the rotor's radius.
    const looks = { paint, dark, glass: material(0x87b5d6, ghost) };
    const forms = { ball: () => new THREE.SphereGeometry(1, 24, 16), box: () => new THREE.BoxGeometry(1, 1, 1), wheel: () => new THREE.CylinderGeometry(1, 1, 1, 20) };
    const fuselage = [["ball", [coaxial ? 0 : 0.1, 0, 0], [0.5, 0.17, coaxial ? 0.26 : 0.2], "paint"], ["ball", [coaxial ? 0.25 : 0.38, 0, -0.05], [0.24, 0.145, 0.14], "glass"]];
    for (const [form, middle, size, look] of picture.parts ?? fuselage) {
      const part = new THREE.Mesh(forms[form](), looks[look]);
      part.position.set(...middle).multiplyScalar(R);
      part.scale.set(...size).multiplyScalar(R);
      body.add(part);
    }

    const top = Math.min(...picture.rotors.map((r) => r.hub[2]), picture.bar ? picture.bar.hub[2] : 0);
    for (const { hub } of picture.rotors) body.add(tube([0, 0, 0], [hub[0], hub[1], coaxial ? top : hub[2]], 0.018 * R, dark));
    const { length, width, depth } = picture.skids ?? {};
    for (const side of picture.skids ? [-1, 1] : []) {
      body.add(tube([-length, side * width, depth], [length, side * width, depth], 0.016 * R, dark));
      for (const end of [-0.5, 0.5])
        body.add(tube([end * length, side * 0.1 * R, 0.1 * R], [end * length, side * width, depth], 0.013 * R, dark));
    }
    if (coaxial && !picture.parts) {
      const fin = new THREE.Mesh(new THREE.BoxGeometry(0.2 * R, 0.02 * R, 0.22 * R), dark);
      fin.position.set(-0.55 * R, 0, -0.08 * R);
      body.add(fin);
    }

    this.rotors = picture.rotors.map((rotor, i) => {
      const shaft = new THREE.Group(), plane = new THREE.Group();
      shaft.position.set(...rotor.hub);
      shaft.rotation.y = -(rotor.tilt || 0);
      plane.rotation.order = "XYZ";
      const spinning = blades(rotor.blades, rotor.radius, 0.09 * rotor.radius, dark);
      plane.add(spinning, disc(rotor.radius, i ? 0x0072b2 : 0x009e73, ghost));
      shaft.add(plane);
      const thrust = new Arrow(i ? 0x0072b2 : 0x009e73, per);
      thrust.mesh.position.set(...rotor.hub);
      this.group.add(shaft, thrust.mesh);
      return { plane, spinning, thrust, sense: rotor.sense };
    });
    this.bar = null;
    if (picture.bar) {
      this.bar = new THREE.Group();
      this.bar.position.set(...picture.bar.hub);
      this.bar.rotation.order = "XYZ";
      const spinning = new THREE.Group(), r = picture.bar.radius;
      spinning.add(tube([-r, 0, 0], [r, 0, 0], 0.015 * R, material(0xe69f00, ghost)));
      for (const end of [-r, r]) {
        const weight = new THREE.Mesh(new THREE.SphereGeometry(0.05 * R, 10, 8), material(0xe69f00, ghost));
        weight.position.x = end;
        spinning.add(weight);
      }
      this.bar.add(merged(spinning));
      this.group.add(this.bar);
    }
    this.tail = null;
    if (picture.tail) {
      const { hub, radius, blades: count } = picture.tail;
      body.add(tube([-0.3 * R, 0, -0.05 * R], [hub[0], 0, hub[2]], 0.03 * R, paint));
      if (picture.fin && picture.fin.side > 0) {
        const fin = new THREE.Mesh(new THREE.BoxGeometry(picture.fin.side, 0.01 * R, picture.fin.side), paint);
        fin.position.set(picture.fin.x, 0, picture.fin.z);
        body.add(fin);
      }
      const holder = new THREE.Group();
      holder.position.set(hub[0], 0.05 * R, hub[2]);
      holder.rotation.x = Math.PI / 2;
      const spinning = blades(count, radius, 0.18 * radius, dark);
      holder.add(spinning, disc(radius, 0xcc79a7, ghost));
      const thrust = new Arrow(0xcc79a7, 3 * per);
      thrust.mesh.position.set(...hub);
      this.group.add(holder, thrust.mesh);
      this.tail = { spinning, thrust };
    }
    this.group.add(merged(body));
  }

  // Position and Euler angles as they are now, discs as last told; `elapsed` seconds of simulation turn the rotors.
  pose(x, parts, elapsed) {
    this.group.position.set(x[0], x[1], x[2]);
    this.group.rotation.set(x[6], x[7], x[8], "ZYX");
    parts.rotors.forEach(([alpha, beta, omega, fx, fy, fz], i) => {
      const rotor = this.rotors[i];
      this.phases[i] = (this.phases[i] + omega * elapsed) % (2 * Math.PI);
      rotor.plane.rotation.set(alpha, beta, 0);
      rotor.spinning.rotation.z = rotor.sense * this.phases[i];
      rotor.thrust.show(fx, fy, fz);
    });
    if (this.bar && parts.bar) {
      this.bar.rotation.set(parts.bar[0], parts.bar[1], 0);
      this.bar.children[0].rotation.z = this.rotors[0].spinning.rotation.z + Math.PI / 2;
    }
    if (this.tail && parts.tail) {
      this.tailPhase = (this.tailPhase + parts.tail[0] * elapsed) % (2 * Math.PI);
      this.tail.spinning.rotation.z = this.tailPhase;
      this.tail.thrust.show(0, parts.tail[1], 0);
    }
  }
}
