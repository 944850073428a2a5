/** @farfield/core: everything about a walk that needs no rendering engine. */

export * from './builder.js';
export * from './cell-index.js';
export * from './cell-streamer.js';
export * from './cells.js';
export * from './choice.js';
export * from './corridor.js';
export * from './errors.js';
export * from './faces.js';
export * from './fetch-queue.js';
export type * from './format.js';
export * from './lru-cache.js';
export * from './manifest.js';
export * from './near.js';
export * from './near-material.js';
export * from './objects/index.js';
export * from './prefetch.js';
export * from './quads.js';
export * from './sectors.js';
export * from './shared-store.js';
export * from './solid.js';
export * from './upload-scheduler.js';
export * from './zip.js';
