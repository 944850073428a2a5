/**
 * A scene's triangles in chunks: a grid over the ground, one mesh per chunk and draw state, each
 * with vertices of its own. This is how a large model is usually made fit for a plain renderer.
 */

export interface SceneArrays {
  /** 3 per vertex. */
  readonly positions: Float32Array;
  /** 3 per triangle. */
  readonly triangles: Uint32Array;
  /** For each batch, its ranges of triangles: first and number. */
  readonly batches: readonly (readonly (readonly [number, number])[])[];
}

export interface Chunk {
  readonly batch: number;
  /** For each vertex of the chunk, its number in the scene. */
  readonly vertices: Uint32Array;
  /** 3 per triangle, numbers of the chunk's vertices. */
  readonly indices: Uint16Array<ArrayBuffer> | Uint32Array<ArrayBuffer>;
}

/** Cut a scene into about `wanted` chunks of equal ground, empty ones left out. */
export function cutChunks({ positions, triangles, batches }: SceneArrays, wanted: number): Chunk[] {
  const side = Math.max(1, Math.round(Math.sqrt(wanted)));
  const [lowX, highX] = range(positions, 0);
  const [lowZ, highZ] = range(positions, 2);
  const place = (value: number, low: number, high: number): number =>
    Math.min(side - 1, Math.max(0, Math.floor(((value - low) / (high - low || 1)) * side)));
  const renumbered = new Int32Array(positions.length / 3).fill(-1);
  const chunks: Chunk[] = [];
  for (const [batch, ranges] of batches.entries()) {
    const lists = new Map<number, number[]>();
    for (const [first, count] of ranges) {
      for (let t = first; t < first + count; t++) {
        const [a, b, c] = [triangles[3 * t], triangles[3 * t + 1], triangles[3 * t + 2]];
        const x = (positions[3 * a] + positions[3 * b] + positions[3 * c]) / 3;
        const z = (positions[3 * a + 2] + positions[3 * b + 2] + positions[3 * c + 2]) / 3;
        const key = place(x, lowX, highX) + side * place(z, lowZ, highZ);
        const list = lists.get(key);
        if (list === undefined) lists.set(key, [t]);
        else list.push(t);
      }
    }
    for (const key of [...lists.keys()].sort((a, b) => a - b)) {
      chunks.push(compact(batch, lists.get(key) ?? [], triangles, renumbered));
    }
  }
  return chunks;
}

/** Give the listed triangles vertices of their own; `renumbered` is scratch, all -1. */
function compact(
  batch: number,
  list: readonly number[],
  triangles: Uint32Array,
  renumbered: Int32Array,
): Chunk {
  const vertices: number[] = [];
  const corners = new Uint32Array(3 * list.length);
  for (const [n, t] of list.entries()) {
    for (let corner = 0; corner < 3; corner++) {
      const vertex = triangles[3 * t + corner];
      if (renumbered[vertex] < 0) renumbered[vertex] = vertices.push(vertex) - 1;
      corners[3 * n + corner] = renumbered[vertex];
    }
  }
  for (const vertex of vertices) renumbered[vertex] = -1;
  const small = vertices.length <= 65_535;
  return {
    batch,
    vertices: Uint32Array.from(vertices),
    indices: small ? Uint16Array.from(corners) : corners,
  };
}

function range(positions: Float32Array, axis: number): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (let n = axis; n < positions.length; n += 3) {
    low = Math.min(low, positions[n]);
    high = Math.max(high, positions[n]);
  }
  return [low, high];
}
