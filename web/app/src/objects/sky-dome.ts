/** The light model's sky as a background. */

import type { Light } from '@farfield/core';
import { BackSide, Color, Mesh, ShaderMaterial, SphereGeometry } from 'three';

export class SkyDome extends Mesh {
  constructor(light: Light) {
    super(
      new SphereGeometry(1000, 32, 16),
      new ShaderMaterial({
        side: BackSide,
        depthWrite: false,
        toneMapped: false,
        uniforms: {
          zenith: { value: new Color(...light.sky_zenith) },
          horizon: { value: new Color(...light.sky_horizon) },
          ground: { value: new Color(...light.sky_ground) },
        },
        vertexShader: `
          varying vec3 way;
          void main() {
            way = position;
            gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
          }`,
        fragmentShader: `
          uniform vec3 zenith, horizon, ground;
          varying vec3 way;
          void main() {
            float y = normalize(way).y;
            vec3 sky = y >= 0.0 ? mix(horizon, zenith, sqrt(y)) : mix(horizon, ground, sqrt(-y));
            gl_FragColor = vec4(sky, 1.0);
            #include <colorspace_fragment>
          }`,
      }),
    );
    this.renderOrder = -1;
  }
}
