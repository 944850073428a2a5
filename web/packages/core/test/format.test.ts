/** The types of `format.ts` name exactly what the JSON Schemas name. */

import { readFileSync } from 'node:fs';
import { describe, expect, test } from 'vitest';
import type { Bounds, CellFile, CellTable, Vec3, WalkFile } from '../src/index.js';

interface Schema {
  readonly $ref?: string;
  readonly $defs?: Readonly<Record<string, Schema>>;
  readonly properties?: Readonly<Record<string, Schema>>;
  readonly items?: Schema | false;
  readonly oneOf?: readonly Schema[];
  readonly anyOf?: readonly Schema[];
}

const FORMAT = '../../../../services/core/farfield_core/format/';
const read = (name: string): Schema =>
  JSON.parse(readFileSync(new URL(FORMAT + name, import.meta.url), 'utf8')) as Schema;

const triple: Vec3 = [0, 0, 0];
const bounds: Bounds = { min: triple, max: triple };
const cells: Required<CellTable> = { i: [0], j: [0], k: [0], y: [0] };

// The compiler holds these to the types, every optional member included; the test to the schemas.
const walk: Required<Omit<WalkFile, 'grid'>> & { grid: Required<WalkFile['grid']> } = {
  format: 'farfield-walk',
  version: 1,
  id: '',
  name: '',
  scene: { id: '', name: '', triangles: 0, bounds },
  settings: {},
  resolution: 1,
  layers: [1],
  borders: [1],
  near_field: 1,
  grid: { origin: triple, size: triple, total: 1, cells, pages: [{ href: '', cells: 1, bounds }] },
  atlas: { width: 1, height: 1, encoding: 'png' },
  light: {
    ambient: triple,
    sun_direction: triple,
    sun: triple,
    hemisphere_up: triple,
    hemisphere_down: triple,
    sky_zenith: triple,
    sky_horizon: triple,
    sky_ground: triple,
  },
  places: { cells: '', atlases: '', near: '' },
  start: { eye: triple, yaw: 0, pitch: 0 },
};

const cell: Required<CellFile> = {
  format: 'farfield-cell',
  version: 1,
  cell: triple,
  eyes: [triple],
  quads: {
    eyes: [0],
    faces: [0],
    layers: [0],
    corner_counts: [3],
    corners: [0],
    planes: [0],
    pages: [0],
    scales: [1],
    offsets: [0],
    turned: [0],
  },
  atlases: [''],
  near: [{ blob: '', ranges: [0] }],
  figures: {},
};

/** Every member that a value names, as dotted paths; those of lists through their first entry. */
function named(value: unknown, path = ''): string[] {
  if (Array.isArray(value)) return named((value as unknown[])[0], path);
  if (typeof value !== 'object' || value === null) return [];
  return Object.entries(value).flatMap(([name, member]) => [
    `${path}${name}`,
    ...named(member, `${path}${name}.`),
  ]);
}

/** Every member that a schema names, likewise. */
function described(schema: Schema, root: Schema, path = ''): string[] {
  const definition = schema.$ref === undefined ? undefined : root.$defs?.[schema.$ref.slice(8)];
  const choices = [...(definition ? [definition] : []), ...(schema.oneOf ?? schema.anyOf ?? [])];
  const inside = schema.items ? described(schema.items, root, path) : [];
  const own = Object.entries(schema.properties ?? {}).flatMap(([name, member]) => [
    `${path}${name}`,
    ...described(member, root, `${path}${name}.`),
  ]);
  return [...own, ...inside, ...choices.flatMap((choice) => described(choice, root, path))];
}

describe('types and schemas name the same members', () => {
  test('walk.json', () => {
    const schema = read('walk.schema.json');
    // The schema leaves the names of the light model to shading/.
    const fixed = named(walk).filter((path) => !path.startsWith('light.'));
    expect(new Set(described(schema, schema))).toEqual(new Set(fixed));
  });

  test('cell files', () => {
    const schema = read('cell.schema.json');
    expect(new Set(described(schema, schema))).toEqual(new Set(named(cell)));
  });
});
