/** What the page's address says: which walk, where to stand, how to behave. */

import type { Vec3 } from '@farfield/core';
import type { NearImpostors } from '@farfield/three';

export interface Pose {
  readonly eye: Vec3;
  readonly yaw: number;
  readonly pitch: number;
}

/** The manifest's address: `?walk=URL`, or the id in `/walk/<id>`; undefined if neither is there. */
export function manifestUrl(page: URL): string | undefined {
  const asked = page.searchParams.get('walk');
  if (asked !== null && asked !== '') return new URL(asked, page).href;
  const match = /\/walk\/([^/]+)\/?$/.exec(page.pathname);
  if (match === null || match[1] === 'index.html') return undefined;
  return new URL(`/api/v1/walks/${match[1]}/walk.json`, page).href;
}

/** Read `#at=x,y,z,yaw,pitch`; yaw and pitch may be left out. */
export function parsePose(hash: string): Pose | undefined {
  const value = new URLSearchParams(hash.replace(/^#/, '')).get('at');
  if (value === null) return undefined;
  const numbers = value.split(',').map((part) => (part.trim() === '' ? NaN : Number(part)));
  if (numbers.length < 3 || numbers.length > 5 || !numbers.every(Number.isFinite)) return undefined;
  const [x, y, z, yaw = 0, pitch = 0] = numbers;
  return { eye: [x, y, z], yaw, pitch };
}

/** The inverse of `parsePose`, short enough to share. */
export function formatPose({ eye, yaw, pitch }: Pose): string {
  const short = (value: number, digits: number): string => String(Number(value.toFixed(digits)));
  return `#at=${[...eye.map((v) => short(v, 2)), short(yaw, 3), short(pitch, 3)].join(',')}`;
}

/** `?capture`: no interface, one device pixel per pixel, alpha 0 where the background shows. */
export function isCapture(page: URL): boolean {
  return page.searchParams.has('capture');
}

/** `?memory=M`: megabytes of texture memory; undefined unless it is a number that can be meant. */
export function textureMemory(page: URL): number | undefined {
  const asked = Number(page.searchParams.get('memory') ?? NaN);
  return asked >= 1 && asked <= 16_384 ? asked : undefined;
}

/** `?fade=S`: seconds in which one cell fades into the next; 0 unless it is a number that can be meant. */
export function fadeSeconds(page: URL): number {
  const asked = Number(page.searchParams.get('fade') ?? NaN);
  return asked > 0 && asked <= 5 ? asked : 0;
}

const WAYS: readonly NearImpostors[] = ['auto', 'always', 'copies', 'never'];

/** `?near=auto|always|copies|never`: how costly objects of the near field are drawn. */
export function nearImpostors(page: URL): NearImpostors {
  const asked = page.searchParams.get('near');
  return WAYS.find((way) => way === asked) ?? 'never';
}

/** `?path=URL`: a recorded path to play. */
export function pathUrl(page: URL): string | undefined {
  const asked = page.searchParams.get('path');
  return asked === null || asked === '' ? undefined : new URL(asked, page).href;
}
