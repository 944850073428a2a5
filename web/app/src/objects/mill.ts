/** A windmill: something tall that moves, with a thousand triangles or as many as wanted. */

import {
  AnimationClip,
  AnimationMixer,
  BoxGeometry,
  Color,
  CylinderGeometry,
  Group,
  IcosahedronGeometry,
  Mesh,
  MeshStandardMaterial,
  NumberKeyframeTrack,
} from 'three';

export interface Mill {
  readonly object: Group;
  readonly mixer: AnimationMixer;
}

export function createMill(hue = 0.08, detail = 5): Mill {
  const object = new Group();
  const paint = (h: number, s: number, l: number): MeshStandardMaterial =>
    new MeshStandardMaterial({ color: new Color().setHSL(h, s, l), roughness: 0.9, metalness: 0 });
  const tower = new Mesh(new CylinderGeometry(0.8, 1.3, 5, 24, 4), paint(hue, 0.35, 0.6));
  tower.position.y = 2.5;
  const roof = new Mesh(new IcosahedronGeometry(1, detail), paint(hue + 0.5, 0.5, 0.4));
  roof.position.y = 5.1;
  const sails = new Group();
  sails.name = 'sails';
  sails.position.set(0, 5, 1.2);
  for (let n = 0; n < 4; n++) {
    const sail = new Mesh(new BoxGeometry(0.5, 3, 0.06), paint(0.12, 0.6, 0.85));
    sail.position.y = 1.7;
    const arm = new Group();
    arm.rotation.z = (n * Math.PI) / 2;
    arm.add(sail);
    sails.add(arm);
  }
  object.add(tower, roof, sails);
  const turn = new NumberKeyframeTrack('sails.rotation[z]', [0, 4], [0, 2 * Math.PI]);
  const mixer = new AnimationMixer(object);
  mixer.clipAction(new AnimationClip('turn', 4, [turn])).play();
  return { object, mixer };
}
