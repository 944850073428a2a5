/**
 * A cell's triangles ordered by the direction in which they lie, so that a camera draws only those
 * around its own view. All directions are divided into sectors around the vertical through the
 * cell's centre; each sector's triangles are one range of the index list. Bounds of what lies in a
 * sector are boxes in homogeneous space, in which a frustum's planes go through the origin: they
 * hold at any distance, the infinite one included.
 */

/** Sectors around, and bands from straight down to straight up in each, with a box of their own. */
export const SECTORS = 16;
const BANDS = 6;
/** A triangle that reaches farther beyond its sector's middle than this, in sectors, is wide. */
const REACH = 1;

export interface Sectors {
  /**
   * First wide triangles, drawn always; then the sectors' round once and once again, so that
   * neighbouring sectors are one range wherever they begin. Within each the order is as it was.
   */
  readonly indices: Uint32Array<ArrayBuffer> | Uint16Array<ArrayBuffer>;
  /** Number of indices of wide triangles. */
  readonly wide: number;
  /** Where each sector of the first round begins, and where that round ends. */
  readonly starts: Uint32Array<ArrayBuffer>;
  /** For each sector and band: lowest x, y, z, w, highest x, y, z, w; lowest > highest if empty. */
  readonly boxes: Float64Array<ArrayBuffer>;
}

/**
 * Order triangles by sector.
 * @param positions 4 per vertex, homogeneous, relative to the centre; w is not negative
 * @param indices 3 per triangle
 */
export function sortBySector(positions: Float32Array, indices: Uint32Array): Sectors {
  const count = indices.length / 3;
  const places = Int8Array.from({ length: count }, (_, t) => sectorOf(positions, indices, 3 * t));
  const sizes = new Uint32Array(SECTORS + 1);
  for (const place of places) sizes[place + 1] += 3;
  const wide = sizes[0];
  const round = indices.length - wide;
  const starts = new Uint32Array(SECTORS + 1);
  starts[0] = wide;
  for (let s = 0; s < SECTORS; s++) starts[s + 1] = starts[s] + sizes[s + 1];
  const small = positions.length / 4 <= 65_536;
  const sorted = new (small ? Uint16Array : Uint32Array)(wide + 2 * round);
  const boxes = new Float64Array(8 * SECTORS * BANDS);
  for (let b = 0; b < boxes.length; b += 8) {
    boxes.fill(Infinity, b, b + 4);
    boxes.fill(-Infinity, b + 4, b + 8);
  }
  const next = Uint32Array.from([0, ...starts.subarray(0, SECTORS)]);
  for (let t = 0; t < count; t++) {
    const corners = indices.subarray(3 * t, 3 * t + 3);
    const at = next[places[t] + 1];
    next[places[t] + 1] += 3;
    sorted.set(corners, at);
    if (places[t] < 0) continue;
    sorted.set(corners, at + round);
    enclose(boxes, places[t], positions, corners);
  }
  return { indices: sorted, wide, starts, boxes };
}

/**
 * The range of indices that holds every triangle of the sectors' which a camera may see.
 * @param matrix from the triangles' homogeneous space to clip space, by columns
 */
export function visibleRange(
  { starts, boxes }: Sectors,
  matrix: ArrayLike<number>,
): { start: number; count: number } {
  const planes: number[][] = [];
  for (const row of [0, 1]) {
    for (const sign of [1, -1]) {
      planes.push([0, 4, 8, 12].map((column) => matrix[column + 3] + sign * matrix[column + row]));
    }
  }
  const seen = Array.from({ length: SECTORS }, (_, n) => isVisible(boxes, n, planes));
  // What is not drawn is the longest run of sectors out of view.
  let [longest, after, run] = [0, 0, 0];
  for (let n = 0; n < 2 * SECTORS && run < SECTORS; n++) {
    run = seen[n % SECTORS] ? 0 : run + 1;
    if (run > longest) [longest, after] = [run, n + 1];
  }
  if (longest === SECTORS) return { start: starts[0], count: 0 };
  const round = starts[SECTORS] - starts[0];
  const first = after % SECTORS;
  const end = first + SECTORS - longest;
  const last = end < SECTORS ? starts[end] : starts[end - SECTORS] + round;
  return { start: starts[first], count: last - starts[first] };
}

/** The sector in which a triangle lies, or -1 if it is wide. */
function sectorOf(positions: Float32Array, indices: Uint32Array, first: number): number {
  let [sumX, sumZ] = [0, 0];
  const angles: number[] = [];
  for (let n = first; n < first + 3; n++) {
    const [x, z] = [positions[4 * indices[n]], positions[4 * indices[n] + 2]];
    const length = Math.hypot(x, z);
    if (length === 0) return -1;
    sumX += x / length;
    sumZ += z / length;
    angles.push(Math.atan2(z, x));
  }
  const turn = 2 * Math.PI;
  const sector = Math.floor(((Math.atan2(sumZ, sumX) + turn) % turn) * (SECTORS / turn)) % SECTORS;
  const middle = ((sector + 0.5) * turn) / SECTORS;
  const reach = (REACH * turn) / SECTORS;
  const within = angles.every((angle) => {
    const away = Math.abs(angle - middle) % turn;
    return Math.min(away, turn - away) <= reach;
  });
  return within ? sector : -1;
}

/** Extend a sector's boxes by a triangle; vertices are taken at length 1 of x, y and z. */
function enclose(
  boxes: Float64Array,
  sector: number,
  positions: Float32Array,
  corners: Uint32Array,
): void {
  const points = [...corners].map((vertex) => {
    const point = positions.subarray(4 * vertex, 4 * vertex + 4);
    const length = Math.hypot(point[0], point[1], point[2]);
    return [...point].map((value) => value / length);
  });
  const height = (points[0][1] + points[1][1] + points[2][1]) / 3;
  const band = Math.min(BANDS - 1, Math.floor(((1 + height) / 2) * BANDS));
  const box = 8 * (sector * BANDS + band);
  for (const point of points) {
    for (let axis = 0; axis < 4; axis++) {
      boxes[box + axis] = Math.min(boxes[box + axis], point[axis]);
      boxes[box + 4 + axis] = Math.max(boxes[box + 4 + axis], point[axis]);
    }
  }
}

/** Whether any box of a sector reaches inside all planes, as far as each plane alone can tell. */
function isVisible(boxes: Float64Array, sector: number, planes: readonly number[][]): boolean {
  for (let box = 8 * sector * BANDS; box < 8 * (sector + 1) * BANDS; box += 8) {
    if (boxes[box] > boxes[box + 4]) continue;
    const inside = planes.every((plane) => {
      let most = 0;
      for (let axis = 0; axis < 4; axis++) {
        const side = plane[axis] > 0 ? 4 : 0;
        most += plane[axis] * boxes[box + side + axis];
      }
      // The GPU's own rounding must not show a triangle that is left out.
      return most > -1e-5 * (Math.abs(plane[0]) + Math.abs(plane[1]) + Math.abs(plane[2]));
    });
    if (inside) return true;
  }
  return false;
}
