/**
 * Unpacks triangles: EXT_meshopt_compression, mode TRIANGLES (the extension's text, "Mode 1: triangles").
 * Its other modes are not used in near blocks. A triangle is mostly an edge that was seen lately and one
 * vertex, which is new, or was seen lately, or is told as a difference; a code byte says which. Small
 * enough not to need the library's WebAssembly, which would have to be waited for, and allowed by pages.
 */

import { FarfieldError } from './errors.js';

/** First byte: index codec, version 1. */
const HEADER = 0xe1;
/** Last bytes: frequent descriptions of triangles without a known edge. */
const TABLE = 16;
const RECENT = 15;

/** The indices, three for each of `count` / 3 triangles; throws FarfieldError 'format'. */
export function unpackTriangles(data: Uint8Array, count: number): Uint32Array<ArrayBuffer> {
  const triangles = count / 3;
  const table = data.length - TABLE;
  if (!Number.isInteger(triangles) || table < 1 + triangles || data[0] !== HEADER) throw damaged();
  const out = new Uint32Array(count);
  const edges = new Uint32Array(2 * (RECENT + 1));
  const vertices = new Uint32Array(RECENT + 1);
  let edgesSeen = 0;
  let verticesSeen = 0;
  let next = 0;
  let last = 0;
  let at = 1 + triangles;

  /** A number told as the difference from the last one so told (zigzag, LEB128). */
  const told = (): number => {
    let value = 0;
    for (let shift = 0; shift < 35; shift += 7) {
      if (at >= table) throw damaged();
      const byte = data[at++];
      value |= (byte & 127) << shift;
      if (byte < 128) break;
    }
    last = (last + ((value >>> 1) ^ -(value & 1))) >>> 0;
    return last;
  };
  const see = (vertex: number): void => {
    vertices[verticesSeen++ & RECENT] = vertex;
  };
  const recent = (back: number): number => vertices[(verticesSeen - back) & RECENT];
  const seeEdge = (a: number, b: number): void => {
    const slot = 2 * (edgesSeen++ & RECENT);
    edges[slot] = a;
    edges[slot + 1] = b;
  };

  for (let t = 0; t < triangles; t++) {
    const code = data[1 + t];
    let a: number;
    let b: number;
    let c: number;
    if (code < 0xf0) {
      const slot = 2 * ((edgesSeen - 1 - (code >> 4)) & RECENT);
      const third = code & 15;
      [a, b] = [edges[slot], edges[slot + 1]];
      if (third === 0) c = next++;
      else if (third < 13) c = recent(1 + third);
      else if (third === 15) c = told();
      else c = last = (last + (third === 13 ? -1 : 1)) >>> 0;
      if (third === 0 || third >= 13) see(c);
    } else {
      let how: number;
      if (code < 0xfe) {
        how = data[table + (code & 15)];
      } else {
        if (at >= table) throw damaged();
        how = data[at++];
        if (how === 0) next = 0;
      }
      const [second, third] = [how >> 4, how & 15];
      const first = code === 0xff ? 15 : 0;
      // New vertices are numbered before any is told.
      a = first === 0 ? next++ : 0;
      b = second === 0 ? next++ : recent(second);
      c = third === 0 ? next++ : recent(third);
      if (first === 15) a = told();
      if (second === 15) b = told();
      if (third === 15) c = told();
      see(a);
      if (second === 0 || second === 15) see(b);
      if (third === 0 || third === 15) see(c);
      seeEdge(b, a);
    }
    seeEdge(c, b);
    seeEdge(a, c);
    out[3 * t] = a;
    out[3 * t + 1] = b;
    out[3 * t + 2] = c;
  }
  if (at !== table) throw damaged();
  return out;
}

function damaged(): FarfieldError {
  return new FarfieldError('format', 'The packed triangles of a near block are damaged.');
}
