// A camera on rails: it goes from cell to cell, waits where one has not come, and says what it sees.
import { cellDistance } from '@farfield/core';
import { Walk, setInfiniteFar } from '@farfield/three';
import { PerspectiveCamera, Scene, Vector3, WebGLRenderer } from 'three';

const text = document.querySelector('p') ?? document.body;
const url = new URLSearchParams(location.search).get('walk') ?? 'walk.json';
const SPEED = 3; // metres a second

const renderer = new WebGLRenderer();
document.body.append(renderer.domElement);
const scene = new Scene();
const camera = new PerspectiveCamera(60, 1, 0.1, 1000);

const walk = new Walk(url, { renderer, textureBytes: 128 * 2 ** 20 });
scene.add(walk.group);
walk.setCamera(camera);

/** Where the rails lead: through the centres of the cells, in the order of the corridor. */
let rails: Vector3[] = [];
walk.addEventListener('load', ({ manifest }) => {
  rails = [...(walk.index?.loaded() ?? [])].map((cell) => new Vector3(...cell.centre));
  camera.position.copy(rails.shift() ?? new Vector3(...manifest.walk.start.eye));
});
walk.addEventListener('cell-change', ({ cell }) => {
  const { quads, nearTriangles, downloads } = walk.stats;
  text.textContent =
    `Cell ${cell.name}: ${quads} quads, ${nearTriangles} near triangles, ` +
    `${(downloads.bytes / 2 ** 20).toFixed(1)} MB so far`;
});
walk.addEventListener('cell-error', ({ cell, absent, error }) => {
  text.textContent = absent ? `Cell ${cell.name} is not baked yet.` : error.message;
});

function resize(): void {
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  setInfiniteFar(camera);
}
addEventListener('resize', resize);
resize();

let last = 0;
renderer.setAnimationLoop((now) => {
  const seconds = Math.min(0.1, (now - last) / 1000);
  last = now;
  const target = rails.at(0);
  const { cell } = walk;
  if (target !== undefined && cell !== undefined) {
    const ahead = target.clone().sub(camera.position);
    const step = Math.min(ahead.length(), SPEED * seconds);
    const next = camera.position.clone().add(ahead.setLength(step));
    // A metre beyond the shown cell is where to wait for the next one.
    if (cellDistance(cell, [next.x, next.y, next.z]) < 1) camera.position.copy(next);
    if (camera.position.distanceTo(target) < 0.05) rails.shift();
    else camera.lookAt(target);
  }
  walk.update();
  renderer.render(scene, camera);
});
