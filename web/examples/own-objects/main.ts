// Objects of your own stand in the walk, and near and far hide them as they should.
import { Walk, setInfiniteFar } from '@farfield/three';
import {
  BoxGeometry,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  Scene,
  WebGLRenderer,
} from 'three';

const text = document.querySelector('p') ?? document.body;
const url = new URLSearchParams(location.search).get('walk') ?? 'walk.json';

const renderer = new WebGLRenderer();
document.body.append(renderer.domElement);
const scene = new Scene();
const camera = new PerspectiveCamera(60, 1, 0.1, 1000);

const walk = new Walk(url, { renderer });
scene.add(walk.group);
walk.setCamera(camera);

const cube = new Mesh(new BoxGeometry(0.5, 0.5, 0.5), new MeshBasicMaterial({ color: 0xff00ff }));
walk.add(cube);

walk.addEventListener('load', ({ manifest }) => {
  const [x, y, z] = manifest.walk.start.eye;
  camera.position.set(x, y, z);
  // Two metres ahead of where the walk starts, looking along -z.
  cube.position.set(x, y, z - 2);
  text.textContent = `A cube in ${manifest.walk.name}`;
});

function resize(): void {
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  // Without this, depths of your objects and of the walk would differ a little.
  setInfiniteFar(camera);
}
addEventListener('resize', resize);
resize();

renderer.setAnimationLoop((now) => {
  cube.rotation.y = now / 1000;
  walk.update();
  renderer.render(scene, camera);
});
