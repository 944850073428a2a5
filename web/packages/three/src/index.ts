/** @farfield/three: walks in three.js scenes. */

export { setInfiniteFar } from './projection.js';
export * from './objects/index.js';
export type { WalkStats } from './stats.js';
export { Walk, type WalkEvents, type WalkOptions } from './walk.js';
