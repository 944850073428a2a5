/** Object impostors: what needs no engine. */

export * from './billboard.js';
export * from './copies.js';
export * from './fade.js';
export * from './find-objects.js';
export * from './freshness.js';
export * from './instance-sort.js';
export * from './object-file.js';
export * from './regeneration.js';
export * from './slot-atlas.js';
export * from './slot-size.js';
export * from './trial.js';
export * as vectors from './vectors.js';
