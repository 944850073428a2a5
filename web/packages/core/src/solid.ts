/**
 * What a walker stands on and bumps into: the near triangles around one cell, in a grid over the
 * ground. Built where cells are built, off the main thread; asked a few times a frame.
 */

import type { Vec3 } from './format.js';
import type { NearBatch } from './near.js';

/** Triangles and, for each square of the grid, which of them lie over it. Can be transferred. */
export interface SolidData {
  /** Lowest x and z of the grid, and the edge of a square. */
  readonly low: readonly [number, number];
  readonly step: number;
  readonly columns: number;
  readonly rows: number;
  /** 9 per triangle, scene coordinates relative to `origin`. */
  readonly corners: Float32Array<ArrayBuffer>;
  readonly origin: Vec3;
  /** Triangles over square s are items[starts[s]] to items[starts[s + 1] - 1]. */
  readonly starts: Uint32Array<ArrayBuffer>;
  readonly items: Uint32Array<ArrayBuffer>;
}

/** How far beyond the cell's sides, in cell edges: a walker may wait there for the next cell. */
const MARGIN = 0.25;
/** Squares along the longer side. */
const SQUARES = 24;
/** Steeper than this is a wall: the least upward part of a floor's unit normal. */
const FLOOR = 0.6;

/**
 * Gather what is solid around the cell of `size` at `centre`: every triangle over the cell and a
 * margin. Foliage, which is masked or screened, is not solid.
 */
export function buildSolid(batches: readonly NearBatch[], centre: Vec3, size: Vec3): SolidData {
  const half = [size[0] * (0.5 + MARGIN), size[2] * (0.5 + MARGIN)] as const;
  const step = (2 * Math.max(...half)) / SQUARES;
  const columns = Math.max(1, Math.ceil((2 * half[0]) / step));
  const rows = Math.max(1, Math.ceil((2 * half[1]) / step));
  const corners: number[] = [];
  const spans: number[] = [];
  const counts = new Uint32Array(columns * rows + 1);
  for (const { state, positions, indices } of batches) {
    if (state.alpha !== 'opaque') continue;
    for (let n = 0; n < indices.length; n += 3) {
      const [a, b, c] = [3 * indices[n], 3 * indices[n + 1], 3 * indices[n + 2]];
      const x0 = Math.min(positions[a], positions[b], positions[c]);
      const x1 = Math.max(positions[a], positions[b], positions[c]);
      const z0 = Math.min(positions[a + 2], positions[b + 2], positions[c + 2]);
      const z1 = Math.max(positions[a + 2], positions[b + 2], positions[c + 2]);
      if (x1 < -half[0] || x0 > half[0] || z1 < -half[1] || z0 > half[1]) continue;
      for (const vertex of [a, b, c]) {
        corners.push(positions[vertex], positions[vertex + 1], positions[vertex + 2]);
      }
      const square = (value: number, low: number, most: number): number =>
        Math.min(most - 1, Math.max(0, Math.floor((value - low) / step)));
      const span = [
        square(x0, -half[0], columns),
        square(x1, -half[0], columns),
        square(z0, -half[1], rows),
        square(z1, -half[1], rows),
      ];
      spans.push(...span);
      eachSquare(span, columns, (s) => counts[s + 1]++);
    }
  }
  for (let s = 0; s < columns * rows; s++) counts[s + 1] += counts[s];
  const items = new Uint32Array(counts[columns * rows]);
  const next = counts.slice();
  for (let t = 0; t < spans.length / 4; t++) {
    eachSquare(spans.slice(4 * t, 4 * t + 4), columns, (s) => (items[next[s]++] = t));
  }
  return {
    low: [-half[0], -half[1]],
    step,
    columns,
    rows,
    corners: Float32Array.from(corners),
    origin: centre,
    starts: counts,
    items,
  };
}

function eachSquare(
  [c0, c1, r0, r1]: readonly number[],
  columns: number,
  visit: (s: number) => void,
): void {
  for (let r = r0; r <= r1; r++) for (let c = c0; c <= c1; c++) visit(r * columns + c);
}

export class Solid {
  private readonly data: SolidData;

  constructor(data: SolidData) {
    this.data = data;
  }

  get triangles(): number {
    return this.data.corners.length / 9;
  }

  /** The greatest height at most `top` of a surface that can be stood on at (x, z), if any. */
  ground(x: number, z: number, top: number): number | undefined {
    const { origin, corners: p } = this.data;
    const [px, pz] = [x - origin[0], z - origin[2]];
    let best = -Infinity;
    for (const t of this.over(px, pz, px, pz)) {
      const [ax, ay, az] = [p[t], p[t + 1], p[t + 2]];
      const [ux, uy, uz] = [p[t + 3] - ax, p[t + 4] - ay, p[t + 5] - az];
      const [vx, vy, vz] = [p[t + 6] - ax, p[t + 7] - ay, p[t + 8] - az];
      const area = ux * vz - uz * vx;
      if (Math.abs(area) < FLOOR * Math.hypot(uy * vz - uz * vy, area, ux * vy - uy * vx)) continue;
      const s = ((px - ax) * vz - (pz - az) * vx) / area;
      const r = (ux * (pz - az) - uz * (px - ax)) / area;
      // A hair over the edge still counts, or feet would fall between two triangles.
      if (s < -1e-4 || r < -1e-4 || s + r > 1.0001) continue;
      const y = ay + s * uy + r * vy + origin[1];
      if (y <= top && y > best) best = y;
    }
    return best === -Infinity ? undefined : best;
  }

  /**
   * Where an upright cylinder at (x, z) of `radius`, from height `low` to `high`, has to go to be
   * clear of walls; as far as a few pushes reach.
   */
  push(x: number, z: number, low: number, high: number, radius: number): [number, number] {
    const { origin } = this.data;
    const [y0, y1] = [low - origin[1], high - origin[1]];
    let [px, pz] = [x - origin[0], z - origin[2]];
    for (let pass = 0; pass < 4; pass++) {
      let deepest: { x: number; z: number; depth: number } | undefined;
      for (const t of this.over(px - radius, pz - radius, px + radius, pz + radius)) {
        const hit = this.overlap(t, px, pz, y0, y1, radius);
        if (hit !== undefined && hit.depth > (deepest?.depth ?? 1e-5)) deepest = hit;
      }
      if (deepest === undefined) break;
      px += deepest.x * deepest.depth;
      pz += deepest.z * deepest.depth;
    }
    return [px + origin[0], pz + origin[2]];
  }

  /** How deep the cylinder stands in a wall, and which way out. */
  private overlap(
    t: number,
    x: number,
    z: number,
    y0: number,
    y1: number,
    radius: number,
  ): { x: number; z: number; depth: number } | undefined {
    const { corners: p } = this.data;
    if (Math.max(p[t + 1], p[t + 4], p[t + 7]) <= y0) return undefined;
    if (Math.min(p[t + 1], p[t + 4], p[t + 7]) >= y1) return undefined;
    const [ux, uy, uz] = [p[t + 3] - p[t], p[t + 4] - p[t + 1], p[t + 5] - p[t + 2]];
    const [vx, vy, vz] = [p[t + 6] - p[t], p[t + 7] - p[t + 1], p[t + 8] - p[t + 2]];
    const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    if (Math.abs(ny) >= FLOOR * Math.hypot(nx, ny, nz)) return undefined;
    // The part of the triangle between the two heights, seen from above.
    const outline = slab(p, t, y0, y1);
    let best: { x: number; z: number; depth: number } | undefined;
    for (let n = 0; n < outline.length; n++) {
      const [ax, az] = outline[n];
      const [bx, bz] = outline[(n + 1) % outline.length];
      const length = (bx - ax) ** 2 + (bz - az) ** 2;
      const along = length === 0 ? 0 : ((x - ax) * (bx - ax) + (z - az) * (bz - az)) / length;
      const at = Math.min(1, Math.max(0, along));
      const [dx, dz] = [x - ax - at * (bx - ax), z - az - at * (bz - az)];
      const distance = Math.hypot(dx, dz);
      if (distance >= radius || radius - distance <= (best?.depth ?? 0)) continue;
      const level = Math.hypot(nx, nz);
      best =
        distance > 1e-6
          ? { x: dx / distance, z: dz / distance, depth: radius - distance }
          : { x: nx / level, z: nz / level, depth: radius };
    }
    return best;
  }

  /** Offsets of the corners of triangles whose squares meet a rectangle; some may come twice. */
  private *over(x0: number, z0: number, x1: number, z1: number): IterableIterator<number> {
    const { low, step, columns, rows, starts, items } = this.data;
    const c0 = Math.max(0, Math.floor((x0 - low[0]) / step));
    const c1 = Math.min(columns - 1, Math.floor((x1 - low[0]) / step));
    const r0 = Math.max(0, Math.floor((z0 - low[1]) / step));
    const r1 = Math.min(rows - 1, Math.floor((z1 - low[1]) / step));
    for (let r = r0; r <= r1; r++) {
      for (let c = c0; c <= c1; c++) {
        const s = r * columns + c;
        for (let n = starts[s]; n < starts[s + 1]; n++) yield 9 * items[n];
      }
    }
  }
}

/** A triangle cut to heights y0 to y1, as its corners' (x, z). */
function slab(p: Float32Array, t: number, y0: number, y1: number): [number, number][] {
  let polygon = [0, 3, 6].map((c): [number, number, number] => [
    p[t + c],
    p[t + c + 1],
    p[t + c + 2],
  ]);
  for (const [sign, level] of [
    [1, y0],
    [-1, y1],
  ] as const) {
    const cut: [number, number, number][] = [];
    for (let n = 0; n < polygon.length; n++) {
      const a = polygon[n];
      const b = polygon[(n + 1) % polygon.length];
      const da = sign * (a[1] - level);
      const db = sign * (b[1] - level);
      if (da >= 0) cut.push(a);
      if (da >= 0 !== db >= 0) {
        const at = da / (da - db);
        cut.push([a[0] + at * (b[0] - a[0]), level, a[2] + at * (b[2] - a[2])]);
      }
    }
    polygon = cut;
  }
  return polygon.map(([x, , z]) => [x, z]);
}
