/** Walking with a headset: three.js does the drawing, the walk's own controls do the walking. */

import type { Camera, Group, WebGLRenderer } from 'three';

/** Whether this browser and what is plugged into it can show the walk in a headset. */
export async function headsetOffered(): Promise<boolean> {
  try {
    return (await navigator.xr?.isSessionSupported('immersive-vr')) === true;
  } catch {
    return false;
  }
}

export class Headset {
  /** Called when the session begins or ends. */
  onChange: (active: boolean) => void = () => undefined;
  private readonly renderer: WebGLRenderer;
  private session: XRSession | undefined;

  /** @param rig holds the camera; what it stands on is the walker's ground */
  constructor(renderer: WebGLRenderer, rig: Group, camera: Camera) {
    this.renderer = renderer;
    rig.add(camera);
  }

  get active(): boolean {
    return this.session !== undefined;
  }

  async enter(): Promise<void> {
    if (this.session !== undefined || navigator.xr === undefined) return;
    const session = await navigator.xr.requestSession('immersive-vr', {
      optionalFeatures: ['local-floor'],
    });
    session.addEventListener('end', () => {
      this.session = undefined;
      this.renderer.xr.enabled = false;
      this.onChange(false);
    });
    this.renderer.xr.enabled = true;
    this.renderer.xr.setReferenceSpaceType('local-floor');
    await this.renderer.xr.setSession(session);
    this.session = session;
    this.onChange(true);
  }

  async leave(): Promise<void> {
    await this.session?.end();
  }
}
