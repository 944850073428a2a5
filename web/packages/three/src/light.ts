/** The light model in a shader, with walk.json's numbers. */

import type { Light } from '@farfield/core';
import { Vector3, type IUniform } from 'three';
import { LIGHT_GLSL } from './shading.generated.js';

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

/**
 * The light model with its numbers as constants of the shader. A walk's light never changes, and a
 * software GL fetches and checks every uniform anew for every few pixels (measured: a sixth of the
 * near polygons' time).
 */
export function lightGlsl(light: Light): string {
  return LIGHT_GLSL.replace(/^uniform vec3 ff_(\w+);/gm, (_, name: keyof Light) => {
    return `const vec3 ff_${name} = vec3(${light[name].map(glslFloat).join(', ')});`;
  });
}

/** A number as GLSL writes it. */
export function glslFloat(value: number): string {
  return value.toExponential();
}
