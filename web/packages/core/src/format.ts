/** The walk format (docs/format.md) as types. Names are the files' own. */

export type Vec3 = readonly [number, number, number];

export interface Bounds {
  readonly min: Vec3;
  readonly max: Vec3;
}

/** Cells by column: lattice index and lowest y of each. */
export interface CellTable {
  readonly i: readonly number[];
  readonly j: readonly number[];
  readonly k: readonly number[];
  readonly y: readonly number[];
}

/** A slice of a large corridor's cells, kept in a file of its own. */
export interface CellPage {
  readonly href: string;
  readonly cells: number;
  readonly bounds: Bounds;
}

export interface WalkGrid {
  readonly origin: Vec3;
  readonly size: Vec3;
  readonly total: number;
  readonly cells?: CellTable | null;
  readonly pages?: readonly CellPage[];
}

/** Linear colours and one unit vector; names are those of shading/, without `ff_`. */
export interface Light {
  readonly ambient: Vec3;
  readonly sun_direction: Vec3;
  readonly sun: Vec3;
  readonly hemisphere_up: Vec3;
  readonly hemisphere_down: Vec3;
  readonly sky_zenith: Vec3;
  readonly sky_horizon: Vec3;
  readonly sky_ground: Vec3;
}

/** walk.json. */
export interface WalkFile {
  readonly format: 'farfield-walk';
  readonly version: 1;
  readonly id: string;
  readonly name: string;
  readonly scene: {
    readonly id: string;
    readonly name: string;
    readonly triangles: number;
    readonly bounds: Bounds;
  };
  readonly settings: Readonly<Record<string, unknown>>;
  readonly resolution: number;
  readonly layers: readonly number[];
  readonly borders: readonly number[];
  readonly near_field: number;
  readonly grid: WalkGrid;
  readonly atlas: {
    readonly width: number;
    readonly height: number;
    readonly encoding: string;
  };
  readonly light: Light;
  readonly places: {
    readonly cells: string;
    readonly atlases: string;
    readonly near: string;
  };
  readonly start: {
    readonly eye: Vec3;
    readonly yaw: number;
    readonly pitch: number;
  };
}

/** Quads by column, drawn front to back in this order. */
export interface QuadColumns {
  readonly eyes: readonly number[];
  readonly faces: readonly number[];
  readonly layers: readonly number[];
  readonly corner_counts: readonly number[];
  readonly corners: readonly number[];
  readonly planes: readonly number[];
  readonly pages: readonly number[];
  readonly scales: readonly number[];
  readonly offsets: readonly number[];
  readonly turned: readonly number[];
}

/** Triangles of one near block: flat (primitive, first triangle, number of triangles) triples. */
export interface NearReference {
  readonly blob: string;
  readonly ranges: readonly number[];
}

/** cells/<i>_<j>_<k>.json. */
export interface CellFile {
  readonly format: 'farfield-cell';
  readonly version: 1;
  readonly cell: Vec3;
  readonly eyes: readonly Vec3[];
  readonly quads: QuadColumns;
  readonly atlases: readonly string[];
  readonly near: readonly NearReference[];
  readonly figures: Readonly<Record<string, number>>;
}

export const WALK_VERSION = 1;
