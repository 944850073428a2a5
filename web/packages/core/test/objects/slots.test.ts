import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { SLOT_SIZES, SlotAtlas, pixelsAcross, slotSize, type Slot } from '../../src/index.js';

describe('slotSize', () => {
  test('texels are no bigger than pixels, and no smaller slot would do', () => {
    fc.assert(
      fc.property(
        fc.double({ min: 0.1, max: 20, noNaN: true }),
        fc.double({ min: 1, max: 500, noNaN: true }),
        (size, distance) => {
          const pixels = pixelsAcross(size, distance, 512);
          const slot = slotSize(pixels, 1);
          const enough = [...SLOT_SIZES].filter((edge) => edge - 2 >= pixels);
          expect(slot).toBe(enough.length === 0 ? undefined : Math.min(...enough));
        },
      ),
    );
  });

  test('what would need more than the largest slot is no impostor', () => {
    expect(slotSize(254, 1)).toBe(256);
    expect(slotSize(255, 1)).toBeUndefined();
    expect(slotSize(1, 1)).toBe(32);
  });
});

describe('SlotAtlas', () => {
  const actions = fc.array(
    fc.oneof(fc.record({ take: fc.constantFrom(...SLOT_SIZES) }), fc.record({ give: fc.nat(40) })),
    { maxLength: 120 },
  );

  test('slots never overlap; a square that is free everywhere can be taken', () => {
    fc.assert(
      fc.property(actions, (list) => {
        const size = 512;
        const atlas = new SlotAtlas(size, 32);
        const cells = size / 32;
        const grid = new Uint8Array(cells * cells); // the oracle: one mark per smallest square
        const taken: Slot[] = [];
        const each = (slot: Slot, visit: (at: number) => void): void => {
          for (let y = slot.y / 32; y < (slot.y + slot.size) / 32; y++)
            for (let x = slot.x / 32; x < (slot.x + slot.size) / 32; x++) visit(y * cells + x);
        };
        for (const action of list) {
          if ('take' in action) {
            const slot = atlas.take(action.take);
            if (slot === undefined) {
              // Then no aligned square of that size is free.
              for (let y = 0; y < size; y += action.take)
                for (let x = 0; x < size; x += action.take) {
                  let free = true;
                  each({ x, y, size: action.take }, (at) => (free &&= grid[at] === 0));
                  expect(free).toBe(false);
                }
              continue;
            }
            expect([slot.x % slot.size, slot.y % slot.size]).toEqual([0, 0]);
            each(slot, (at) => {
              expect(grid[at]).toBe(0);
              grid[at] = 1;
            });
            taken.push(slot);
          } else if (taken.length > 0) {
            const [slot] = taken.splice(action.give % taken.length, 1);
            each(slot, (at) => (grid[at] = 0));
            atlas.give(slot);
          }
          expect(atlas.fill).toBeCloseTo(grid.reduce((sum, n) => sum + n, 0) / grid.length, 12);
        }
        for (const slot of taken) atlas.give(slot);
        expect(atlas.take(size)).toBeDefined(); // everything was joined again
      }),
    );
  });

  test('is filled to the last texel', () => {
    const atlas = new SlotAtlas(256, 32);
    for (let n = 0; n < 64; n++) expect(atlas.take(32)).toBeDefined();
    expect(atlas.take(32)).toBeUndefined();
    expect(atlas.fill).toBe(1);
  });

  test('a slot is given back once', () => {
    const atlas = new SlotAtlas(256, 32);
    const slot = atlas.take(64);
    if (slot === undefined) throw new Error('there is room');
    atlas.give(slot);
    expect(() => atlas.give(slot)).toThrow('not taken');
    expect(atlas.take(512)).toBeUndefined();
  });
});
