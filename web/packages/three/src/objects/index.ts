/** Object impostors in three.js. */

export type { ImpostorOptions } from './object-impostor.js';
export {
  ObjectImpostors,
  type ImpostorStats,
  type ObjectImpostorsOptions,
} from './object-impostors.js';
export type { NearImpostors } from './walk-objects.js';
export {
  TrueImpostors,
  loadObject,
  type BakedObject,
  type TrueImpostorOptions,
} from './true-impostors.js';
