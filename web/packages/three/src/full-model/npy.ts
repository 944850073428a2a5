/** NumPy's array files, version 1 to 3, little-endian and in C order. */

import { FarfieldError } from '@farfield/core';

export type NpyData = Float32Array | Int8Array | Uint16Array | Uint32Array;

export interface Npy {
  readonly data: NpyData;
  readonly shape: readonly number[];
}

const TYPES: Readonly<
  Record<string, ((buffer: ArrayBuffer, at: number, count: number) => NpyData) | undefined>
> = {
  '<f4': (buffer, at, count) => new Float32Array(buffer, at, count),
  '|i1': (buffer, at, count) => new Int8Array(buffer, at, count),
  '<u2': (buffer, at, count) => new Uint16Array(buffer, at, count),
  '<u4': (buffer, at, count) => new Uint32Array(buffer, at, count),
};

/** Read an array in place; throws FarfieldError 'format'. */
export function readNpy(bytes: ArrayBuffer): Npy {
  const bad = (): FarfieldError =>
    new FarfieldError('format', 'A file of the scene is not an array that can be read.');
  const view = new DataView(bytes);
  if (bytes.byteLength < 16 || view.getUint32(0) !== 0x934e554d) throw bad();
  const wide = view.getUint8(6) > 1;
  const start = wide ? 12 : 10;
  const length = wide ? view.getUint32(8, true) : view.getUint16(8, true);
  const header = new TextDecoder().decode(new Uint8Array(bytes, start, length));
  const type = /'descr': '([^']+)'/.exec(header)?.[1] ?? '';
  const shape = /'shape': \(([^)]*)\)/.exec(header)?.[1];
  const make = TYPES[type];
  if (make === undefined || shape === undefined || !header.includes("'fortran_order': False")) {
    throw bad();
  }
  const sides = shape
    .split(',')
    .filter((side) => side.trim() !== '')
    .map(Number);
  const count = sides.reduce((product, side) => product * side, 1);
  try {
    return { data: make(bytes, start + length, count), shape: sides };
  } catch {
    throw bad();
  }
}
