/** Numbers about a walk, for readouts and tests. */

import type { Cell, FetchQueue } from '@farfield/core';
import type { CellView } from './cell-view.js';
import type { Stage } from './stage.js';

export interface WalkStats {
  /** Name of the shown cell. */
  readonly cell: string | undefined;
  readonly quads: number;
  readonly nearTriangles: number;
  /** Draw calls of the walk: far, near and in all, the sky included. */
  readonly drawCalls: { readonly far: number; readonly near: number; readonly total: number };
  /** Texture memory held, all of the page pool included, and its cap. */
  readonly textureBytes: number;
  readonly textureCap: number;
  readonly geometryBytes: number;
  readonly cells: { readonly ready: number; readonly loading: number };
  readonly uploads: number;
  readonly downloads: {
    readonly bytes: number;
    readonly finished: number;
    readonly pending: number;
  };
  /** Seconds from asking for a cell to showing it, lately. */
  readonly loadSeconds: number;
}

export interface StatsSource {
  readonly stage: Stage | undefined;
  readonly view: CellView | undefined;
  readonly cell: Cell | undefined;
  readonly queue: FetchQueue;
  readonly loadSeconds: number;
  readonly textureCap: number;
}

export function readStats(source: StatsSource): WalkStats {
  const { stage, view, cell, queue, loadSeconds, textureCap } = source;
  const far = view?.farMeshes.length ?? 0;
  const near = view?.near.length ?? 0;
  return {
    cell: cell?.name,
    quads: view?.quads ?? 0,
    nearTriangles: view?.nearTriangles ?? 0,
    drawCalls: { far, near, total: far + near + (stage?.sky === undefined ? 0 : 1) },
    textureBytes: stage === undefined ? 0 : stage.pages.bytes + stage.textures.bytes,
    textureCap,
    geometryBytes: stage?.streamer.bytes ?? 0,
    cells: {
      ready: stage?.streamer.count('ready') ?? 0,
      loading: stage?.streamer.count('loading') ?? 0,
    },
    uploads: stage?.uploads.pending ?? 0,
    downloads: { bytes: queue.bytes, finished: queue.finished, pending: queue.pending },
    loadSeconds,
  };
}
