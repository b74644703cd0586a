// What shows speed and height: a sky, fields that lie still, posts of one cell's height with bands.
import * as THREE from "./vendor/three.module.min.js";

const HORIZON = 0xdbe8f2, ZENITH = 0x5b93c7, FIELDS = ["#b9c8ae", "#aebf9f", "#c3cfb4", "#a9b894", "#c9c9a5"];
const TILE = 8; // cells after which the fields repeat
const POSTS = 9, APART = 4; // to each side in all; cells between them
const BANDS = 4, RED = [0.7, 0.23, 0], WHITE = [1, 1, 1];

// The same fields every time; `plainly`: as a processor without a graphics card draws them fastest.
function fields(plainly) {
  const canvas = document.createElement("canvas"), side = 16;
  canvas.width = canvas.height = 16 * side;
  const plain = canvas.getContext("2d");
  let state = 7;
  const random = () => (state = (state * 16807) % 2147483647) / 2147483647;
  for (let i = 0; i < side; i += 1)
    for (let j = 0; j < side; j += 1) {
      plain.fillStyle = FIELDS[Math.floor(random() * FIELDS.length)];
      plain.fillRect(16 * i, 16 * j, 16, 16);
    }
  const texture = new THREE.CanvasTexture(canvas);
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  if (plainly) {
    texture.generateMipmaps = false;
    texture.minFilter = texture.magFilter = THREE.NearestFilter;
  }
  if (!plainly) texture.colorSpace = THREE.SRGBColorSpace;
  return texture;
}

function sky() {
  const ball = new THREE.SphereGeometry(1, 24, 12), { position } = ball.attributes;
  const low = new THREE.Color(HORIZON), high = new THREE.Color(ZENITH), colors = [];
  for (let i = 0; i < position.count; i += 1) colors.push(...low.clone().lerp(high, Math.min(1, Math.max(0, 1.6 * position.getY(i)))));
  ball.setAttribute("color", new THREE.Float32BufferAttribute(colors, 3));
  return new THREE.Mesh(ball, new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.BackSide, fog: false, depthWrite: false }));
}

function posts(cell) {
  const post = new THREE.CylinderGeometry(0.03 * cell, 0.03 * cell, cell, 3, BANDS).toNonIndexed(), { position } = post.attributes, colors = [];
  for (let i = 0; i < position.count; i += 3) {
    const middle = (position.getY(i) + position.getY(i + 1) + position.getY(i + 2)) / 3 / cell + 0.5; // of a triangle
    for (let k = 0; k < 3; k += 1) colors.push(...(Math.floor(middle * BANDS * 0.999) % 2 ? WHITE : RED));
  }
  post.setAttribute("color", new THREE.Float32BufferAttribute(colors, 3));
  return new THREE.InstancedMesh(post, new THREE.MeshBasicMaterial({ vertexColors: true }), POSTS * POSTS);
}

export class Land {
  constructor(scene, { cell, floor, grounded, software }) {
    Object.assign(this, { scene, cell, floor, grounded });
    this.grid = new THREE.GridHelper(60 * cell, 60, 0x6f8a70, 0x9db09a);
    const map = fields(software), side = 50 * TILE;
    map.repeat.set(side / TILE, side / TILE);
    this.ground = new THREE.Mesh(new THREE.PlaneGeometry(side * cell, side * cell), new THREE.MeshBasicMaterial({ map }));
    this.ground.rotation.x = -Math.PI / 2;
    this.posts = posts(cell);
    this.posts.frustumCulled = false;
    this.sky = sky();
    this.sky.scale.setScalar(1500);
    this.sky.renderOrder = -1;
    this.sky.visible = !software; // half a picture that a processor paints twice
    this.ground.visible = this.posts.visible = grounded; // without ground the grid is a level to look at, and may be flown through
    scene.add(this.grid, this.ground, this.posts, this.sky);
    scene.fog.near = 12 * cell;
    scene.fog.far = 34 * cell;
  }
  remove() {
    this.scene.remove(this.grid, this.ground, this.posts, this.sky);
  }
  // As much of it as is around a place, at rest itself.
  around(at, eye) {
    const { cell } = this, near = (value, step) => Math.round(value / step) * step;
    this.grid.position.set(near(at.x, cell), -this.floor, near(at.z, cell));
    this.ground.position.set(near(at.x, TILE * cell), -this.floor - 0.004 * cell, near(at.z, TILE * cell));
    this.sky.position.copy(eye);
    const [x, z] = [near(at.x, APART * cell), near(at.z, APART * cell)];
    if (this.planted === `${x} ${z}`) return;
    this.planted = `${x} ${z}`;
    const place = new THREE.Matrix4(), half = (POSTS - 1) / 2;
    for (let k = 0; k < POSTS * POSTS; k += 1)
      this.posts.setMatrixAt(k, place.makeTranslation(x + ((k % POSTS) - half + 0.5) * APART * cell, cell / 2 - this.floor, z + (Math.floor(k / POSTS) - half + 0.5) * APART * cell));
    this.posts.instanceMatrix.needsUpdate = true;
  }
}
