/** What the interface shows, sampled from a session a few times a second. */

import type { WalkStats } from '@farfield/three';
import type { Session } from './session.js';
import { walkingSpeed } from './walker.js';

export interface ViewState {
  readonly phase: 'opening' | 'first-cell' | 'walking';
  readonly name: string;
  readonly stats: WalkStats;
  readonly fps: number;
  readonly frameTimes: readonly number[];
  /** A short remark about what is going on, or nothing. */
  readonly remark: string | undefined;
  /** Metres a second that walking goes at. */
  readonly speed: number;
  readonly playing: boolean;
  readonly recording: boolean;
  readonly flying: boolean;
}

export function readState(session: Session): ViewState {
  const { walk, walker, frameTimes } = session;
  const recent = frameTimes.slice(-60);
  const mean = recent.reduce((sum, time) => sum + time, 0) / Math.max(1, recent.length);
  return {
    phase:
      walk.manifest === undefined ? 'opening' : walk.cell === undefined ? 'first-cell' : 'walking',
    name: walk.manifest?.walk.name ?? '',
    stats: walk.stats,
    fps: mean === 0 ? 0 : 1000 / mean,
    frameTimes: [...frameTimes],
    remark: remark(session),
    speed: speed(session),
    playing: session.playback !== undefined,
    recording: session.recorder !== undefined,
    flying: walker.flying,
  };
}

function speed({ walk, walker }: Session): number {
  const size = walk.index?.grid.size;
  if (size === undefined) return 0;
  return Math.min(walk.topSpeed, walker.pace * walkingSpeed(Math.min(size[0], size[2])));
}

function remark({ walk, walker }: Session): string | undefined {
  if (!navigator.onLine) return 'You are offline. What has been loaded can still be walked.';
  const wanted = walk.wanted;
  if (wanted !== undefined && !walk.settled) {
    if (wanted.state === 'absent') return 'This part is still being baked.';
    if (wanted.state === 'failed') {
      return `This part could not be loaded. ${wanted.error?.message ?? ''}`.trim();
    }
    if (walk.cell !== undefined) return 'Loading this part…';
  }
  return walker.blocked ? 'The corridor ends here: nothing beyond it is baked.' : undefined;
}

/** An error in words for whoever opened the page. */
export function explain(error: Error): { title: string; text: string } {
  const code = 'code' in error ? error.code : undefined;
  switch (code) {
    case 'not-found':
      return {
        title: 'There is no walk here',
        text: 'The address may be mistyped, or the walk has been removed.',
      };
    case 'network':
      return { title: 'The walk can’t be reached', text: error.message };
    case 'format':
      return { title: 'This is not a walk that can be opened', text: error.message };
    case 'unsupported':
      return { title: 'This device can’t show the walk', text: error.message };
    default:
      return { title: 'Something went wrong', text: error.message };
  }
}
