/**
 * Instances by distance, as blending needs them, in time that grows with their number alone: a
 * counting sort over 65,536 steps of distance.
 */

const STEPS = 65536;

/**
 * The order of instances from the farthest to the nearest.
 *
 * @param places 4 numbers per instance, of which the first 3 are its place
 * @param eye in the same coordinates
 */
export function backToFront(
  places: Float32Array,
  eye: readonly [number, number, number],
): Uint32Array<ArrayBuffer> {
  const count = places.length / 4;
  const away = new Float32Array(count);
  let [nearest, farthest] = [Infinity, 0];
  for (let n = 0; n < count; n++) {
    const x = places[4 * n] - eye[0];
    const y = places[4 * n + 1] - eye[1];
    const z = places[4 * n + 2] - eye[2];
    away[n] = Math.sqrt(x * x + y * y + z * z);
    nearest = Math.min(nearest, away[n]);
    farthest = Math.max(farthest, away[n]);
  }
  const scale = farthest > nearest ? (STEPS - 1) / (farthest - nearest) : 0;
  const starts = new Uint32Array(STEPS + 1);
  const step = Uint16Array.from(away, (distance) => (farthest - distance) * scale);
  for (const bin of step) starts[bin + 1]++;
  for (let bin = 0; bin < STEPS; bin++) starts[bin + 1] += starts[bin];
  const order = new Uint32Array(count);
  for (let n = 0; n < count; n++) order[starts[step[n]]++] = n;
  return order;
}
