// The least a page needs: a renderer, a camera, a walk. Drag to look around.
import { Walk, setInfiniteFar } from '@farfield/three';
import { PerspectiveCamera, Scene, WebGLRenderer } from 'three';

const text = document.querySelector('p') ?? document.body;
const url = new URLSearchParams(location.search).get('walk') ?? 'walk.json';

const renderer = new WebGLRenderer();
document.body.append(renderer.domElement);
const scene = new Scene();
const camera = new PerspectiveCamera(60, 1, 0.1, 1000);
camera.rotation.order = 'YXZ';

const walk = new Walk(url, { renderer });
scene.add(walk.group);
walk.setCamera(camera);

walk.loaded.then(
  ({ walk: { name, start } }) => {
    text.textContent = name;
    camera.position.set(...start.eye);
    camera.rotation.set(start.pitch, start.yaw, 0);
  },
  (error: unknown) => (text.textContent = String(error)),
);

function resize(): void {
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  setInfiniteFar(camera);
}
addEventListener('resize', resize);
resize();

renderer.domElement.addEventListener('pointermove', (event) => {
  if (event.buttons === 0) return;
  camera.rotation.y += 0.004 * event.movementX;
  camera.rotation.x = Math.max(-1.5, Math.min(1.5, camera.rotation.x + 0.004 * event.movementY));
});

renderer.setAnimationLoop(() => {
  walk.update();
  renderer.render(scene, camera);
});
