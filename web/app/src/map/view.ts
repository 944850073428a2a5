/** Where the map is looked at: ground (x, z) in metres to pixels and back. */

export interface Spot {
  readonly x: number;
  readonly z: number;
}

export interface Pixel {
  readonly left: number;
  readonly top: number;
}

export interface Area {
  readonly min: readonly [number, number];
  readonly max: readonly [number, number];
}

/** A window of `width` x `height` pixels; `centre` lies in its middle, at `scale` pixels a metre. */
export class MapWindow {
  readonly width: number;
  readonly height: number;
  readonly centre: Spot;
  readonly scale: number;

  constructor(width: number, height: number, centre: Spot, scale: number) {
    this.width = width;
    this.height = height;
    this.centre = centre;
    this.scale = scale;
  }

  /** Show all of an area, with a margin. */
  static fit(width: number, height: number, area: Area, margin = 0.06): MapWindow {
    const [x0, z0] = area.min;
    const [x1, z1] = area.max;
    const room = 1 + 2 * margin;
    const scale = Math.min(
      width / (Math.max(x1 - x0, 1e-6) * room),
      height / (Math.max(z1 - z0, 1e-6) * room),
    );
    return new MapWindow(width, height, { x: (x0 + x1) / 2, z: (z0 + z1) / 2 }, scale);
  }

  pixel(spot: Spot): Pixel {
    return {
      left: this.width / 2 + (spot.x - this.centre.x) * this.scale,
      top: this.height / 2 + (spot.z - this.centre.z) * this.scale,
    };
  }

  spot(pixel: Pixel): Spot {
    return {
      x: this.centre.x + (pixel.left - this.width / 2) / this.scale,
      z: this.centre.z + (pixel.top - this.height / 2) / this.scale,
    };
  }

  /** The same place in a window of another size. */
  resized(width: number, height: number): MapWindow {
    return new MapWindow(width, height, this.centre, this.scale);
  }

  /** What is at `from` moves to `to`. */
  moved(from: Pixel, to: Pixel): MapWindow {
    const centre = {
      x: this.centre.x - (to.left - from.left) / this.scale,
      z: this.centre.z - (to.top - from.top) / this.scale,
    };
    return new MapWindow(this.width, this.height, centre, this.scale);
  }

  /** Magnify around a pixel, which keeps its spot. */
  zoomed(at: Pixel, factor: number, least: number, most: number): MapWindow {
    const scale = Math.min(most, Math.max(least, this.scale * factor));
    const spot = this.spot(at);
    const centre = {
      x: spot.x - (at.left - this.width / 2) / scale,
      z: spot.z - (at.top - this.height / 2) / scale,
    };
    return new MapWindow(this.width, this.height, centre, scale);
  }
}
