/** The light model's uniforms, shared by everything that is shaded. */

import type { Light } from '@farfield/core';
import { Vector3, type IUniform } from 'three';

export type Uniforms = Record<string, IUniform>;

/** Uniforms of shading/ under their own names, from walk.json's constants. */
export function lightUniforms(light: Light): Uniforms {
  return Object.fromEntries(
    Object.entries(light).map(([name, value]) => [
      `ff_${name}`,
      { value: new Vector3(...(value as [number, number, number])) },
    ]),
  );
}
