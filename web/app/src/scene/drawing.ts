/** A corridor while it is drawn on the map. */

import type { Corridor, Suggestion, Triple } from '../api.js';
import type { Area, Spot } from '../map/view.js';

export type Kind = 'path' | 'box';

export interface Drawing {
  readonly kind: Kind;
  /** Of a path its points, of a box two opposite corners. */
  readonly points: readonly Triple[];
  readonly width: number;
  readonly height: number;
  readonly eye: number;
}

/** What the server suggests, ready to be changed. */
export function fromSuggestion({ corridor, cell_size, eye_height }: Suggestion): Drawing {
  const path = corridor.path ?? undefined;
  return {
    kind: 'path',
    points: path?.points ?? [],
    width: path?.width ?? 0.8 * cell_size,
    height: path?.height ?? 2 * eye_height,
    eye: eye_height,
  };
}

/** Height of the floor where nobody has clicked before: that of the nearest point. */
export function floorNear(points: readonly Triple[], spot: Spot, fallback: number): number {
  let best = Infinity;
  let floor = fallback;
  for (const [x, y, z] of points) {
    const distance = Math.hypot(x - spot.x, z - spot.z);
    if (distance < best) [best, floor] = [distance, y];
  }
  return floor;
}

/** Index of the point within `reach` metres of a spot, the nearest; -1 without one. */
export function pointAt(drawing: Drawing, spot: Spot, reach: number): number {
  let best = reach;
  let found = -1;
  drawing.points.forEach(([x, , z], index) => {
    const distance = Math.hypot(x - spot.x, z - spot.z);
    if (distance <= best) [best, found] = [distance, index];
  });
  return found;
}

export function withPoint(drawing: Drawing, spot: Spot, floor: number): Drawing {
  return { ...drawing, points: [...drawing.points, [spot.x, floor, spot.z]] };
}

export function movedPoint(drawing: Drawing, index: number, spot: Spot): Drawing {
  const points = drawing.points.map((point, n): Triple =>
    n === index ? [spot.x, point[1], spot.z] : point,
  );
  return { ...drawing, points };
}

/** The corridor to ask for; undefined while too little is drawn. */
export function corridorOf(drawing: Drawing): Corridor | undefined {
  const { kind, points, width, height, eye } = drawing;
  if (!(width > 0 && height > 0 && eye > 0)) return undefined;
  if (kind === 'path') {
    if (points.length === 0) return undefined;
    return { path: { points, width, height }, follow_ground: true, eye_height: eye };
  }
  const area = boxOf(drawing);
  if (area === undefined) return undefined;
  const floor = Math.min(...points.map((point) => point[1]));
  return {
    box: {
      min: [area.min[0], floor, area.min[1]],
      max: [area.max[0], floor + height, area.max[1]],
    },
    follow_ground: true,
    eye_height: eye,
  };
}

/** The ground that a box covers. */
export function boxOf({ points }: Drawing): Area | undefined {
  if (points.length < 2) return undefined;
  const [a, b] = [points[0], points[1]];
  const area: Area = {
    min: [Math.min(a[0], b[0]), Math.min(a[2], b[2])],
    max: [Math.max(a[0], b[0]), Math.max(a[2], b[2])],
  };
  return area.max[0] > area.min[0] && area.max[1] > area.min[1] ? area : undefined;
}

/** What is drawn, with room around it; the whole map if nothing is. */
export function areaOf(drawing: Drawing, all: Area, room: number): Area {
  if (drawing.points.length === 0) return all;
  const x = drawing.points.map((point) => point[0]);
  const z = drawing.points.map((point) => point[2]);
  return {
    min: [Math.min(...x) - room, Math.min(...z) - room],
    max: [Math.max(...x) + room, Math.max(...z) + room],
  };
}
