/** A recorded path: poses at a steady rate, played back as fast as cells arrive. */

import { FarfieldError, type Vec3 } from '@farfield/core';
import type { Pose } from './address.js';

/** Poses a second in a recording. */
export const RATE = 30;

export interface PathFile {
  readonly format: 'farfield-path';
  readonly version: 1;
  /** Poses a second. */
  readonly rate: number;
  /** x, y, z, yaw, pitch. */
  readonly poses: readonly (readonly [number, number, number, number, number])[];
}

/** Read a path file; throws FarfieldError 'format'. */
export function parsePath(text: string): PathFile {
  const bad = (why: string): FarfieldError =>
    new FarfieldError('format', `The path can't be played: ${why}.`);
  let value: Partial<PathFile> | null;
  try {
    value = JSON.parse(text) as Partial<PathFile> | null;
  } catch {
    throw bad('the file is not JSON');
  }
  if (value?.format !== 'farfield-path' || value.version !== 1) {
    throw bad('the file is not a path of version 1');
  }
  const { poses, rate } = value;
  if (!(Number(rate) > 0) || !Array.isArray(poses) || poses.length === 0) {
    throw bad('it has no poses, or no rate');
  }
  const whole = poses.every(
    (pose: unknown) =>
      Array.isArray(pose) && pose.length === 5 && pose.every((n) => Number.isFinite(n)),
  );
  if (!whole) throw bad('a pose is not five numbers');
  return value as PathFile;
}

/** The pose between recorded ones; `at` counts poses and is held at both ends. */
export function poseAt({ poses }: PathFile, at: number): Pose {
  const clamped = Math.min(poses.length - 1, Math.max(0, at));
  const first = Math.min(Math.max(0, poses.length - 2), Math.floor(clamped));
  const [a, b] = [poses[first], poses[Math.min(poses.length - 1, first + 1)]];
  const share = clamped - first;
  const mix = (n: number): number => a[n] + share * (b[n] - a[n]);
  const turn = Math.atan2(Math.sin(b[3] - a[3]), Math.cos(b[3] - a[3]));
  const eye: Vec3 = [mix(0), mix(1), mix(2)];
  return { eye, yaw: a[3] + share * turn, pitch: mix(4) };
}

/** Collects poses while a person walks. */
export class Recorder {
  private readonly poses: [number, number, number, number, number][] = [];
  private due = 0;

  /** Note where the walker is after so many seconds. */
  step(seconds: number, { eye, yaw, pitch }: Pose): void {
    this.due += seconds * RATE;
    while (this.due >= 1) {
      this.due -= 1;
      const round = (value: number): number => Math.round(value * 1e4) / 1e4;
      this.poses.push([round(eye[0]), round(eye[1]), round(eye[2]), round(yaw), round(pitch)]);
    }
  }

  get file(): PathFile {
    return { format: 'farfield-path', version: 1, rate: RATE, poses: this.poses };
  }
}
