/**
 * Square slots in one texture, packed without waste: sizes are powers of two, and every slot is
 * halved twice from a larger one (a quadtree of free squares, Knowlton's buddy system in 2D).
 */

export interface Slot {
  /** Lower left corner and edge, texels. */
  readonly x: number;
  readonly y: number;
  readonly size: number;
}

export class SlotAtlas {
  /** Edge of the texture, texels. */
  readonly size: number;
  private readonly smallest: number;
  /** Free squares by edge, each by its key. */
  private readonly free = new Map<number, Map<number, Slot>>();
  private readonly used = new Set<number>();
  private usedTexels = 0;

  /** Both sizes are powers of two. */
  constructor(size: number, smallest: number) {
    this.size = size;
    this.smallest = smallest;
    for (let edge = smallest; edge <= size; edge *= 2) this.free.set(edge, new Map());
    this.release({ x: 0, y: 0, size });
  }

  /** Share of the texture that is taken. */
  get fill(): number {
    return this.usedTexels / this.size ** 2;
  }

  /** A free slot, or undefined if there is no room. */
  take(size: number): Slot | undefined {
    const slot = this.split(size);
    if (slot === undefined) return undefined;
    this.used.add(this.key(slot));
    this.usedTexels += size ** 2;
    return slot;
  }

  /** Give a slot back. */
  give(slot: Slot): void {
    if (!this.used.delete(this.key(slot))) throw new Error('This slot is not taken.');
    this.usedTexels -= slot.size ** 2;
    this.release(slot);
  }

  private split(size: number): Slot | undefined {
    const free = this.free.get(size);
    if (free === undefined) return undefined;
    for (const [key, slot] of free) {
      free.delete(key);
      return slot;
    }
    const whole = this.split(2 * size);
    if (whole === undefined) return undefined;
    const [slot, ...rest] = quarters(whole);
    for (const quarter of rest) free.set(this.key(quarter), quarter);
    return slot;
  }

  /** Make a square free, joining it with its three neighbours where they are free too. */
  private release(slot: Slot): void {
    const free = this.free.get(slot.size);
    if (free === undefined) throw new Error('Slots are no larger than the atlas.');
    free.set(this.key(slot), slot);
    const edge = 2 * slot.size;
    if (edge > this.size) return;
    const parent = { x: slot.x - (slot.x % edge), y: slot.y - (slot.y % edge), size: edge };
    const keys = quarters(parent).map((quarter) => this.key(quarter));
    if (!keys.every((key) => free.has(key))) return;
    for (const key of keys) free.delete(key);
    this.release(parent);
  }

  private key({ x, y }: Slot): number {
    return (y / this.smallest) * (this.size / this.smallest) + x / this.smallest;
  }
}

function quarters({ x, y, size }: Slot): [Slot, Slot, Slot, Slot] {
  const half = size / 2;
  return [
    { x, y, size: half },
    { x: x + half, y, size: half },
    { x, y: y + half, size: half },
    { x: x + half, y: y + half, size: half },
  ];
}
