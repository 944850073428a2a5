import { Group } from 'three';
import { describe, expect, test } from 'vitest';
import { CellView } from '../src/cell-view.js';
import { Fade } from '../src/fade.js';

/** A cell that is drawn; only what a fade looks at. */
function shown(): CellView {
  const group = new Group();
  new Group().add(group);
  return Object.assign(Object.create(CellView.prototype) as CellView, { group, fade: 0 });
}

describe('Fade', () => {
  test('one goes while the other comes, and every pixel has just one of them', () => {
    const [a, b] = [shown(), shown()];
    const fade = new Fade(2);
    fade.change(a, b, 10);
    for (const [now, share] of [
      [10.5, 0.25],
      [11, 0.5],
      [11.9, 0.95],
    ]) {
      fade.update(now, true);
      expect(b.fade).toBeCloseTo(share, 9);
      expect(a.fade).toBe(-b.fade);
      expect(a.group.visible).toBe(true);
    }
    fade.update(12, true);
    expect([a.fade, a.group.visible, b.fade]).toEqual([0, false, 0]);
  });

  test('the first cell of all, and a fade of no length, appear at once', () => {
    const [a, b] = [shown(), shown()];
    new Fade(2).change(undefined, a, 0);
    expect(a.fade).toBe(0);
    const none = new Fade(0);
    none.change(a, b, 0);
    expect([a.fade, a.group.visible, b.fade]).toEqual([0, false, 0]);
    none.update(0, true);
    expect(b.fade).toBe(0);
  });

  test('a third cell ends the fade of the first two', () => {
    const [a, b, c] = [shown(), shown(), shown()];
    const fade = new Fade(2);
    fade.change(a, b, 0);
    fade.update(1, true);
    fade.change(b, c, 1);
    fade.update(1.5, true);
    expect([a.fade, a.group.visible]).toEqual([0, false]);
    expect([b.fade, c.fade]).toEqual([-0.25, 0.25]);
  });

  test('going back on the way turns the fade round', () => {
    const [a, b] = [shown(), shown()];
    const fade = new Fade(2);
    fade.change(a, b, 0);
    fade.change(b, a, 1);
    fade.update(1.5, true);
    expect([a.fade, b.fade]).toEqual([0.25, -0.25]);
  });

  test('a cell that was let go of ends it; hidden cells stay hidden', () => {
    const [a, b] = [shown(), shown()];
    const fade = new Fade(2);
    fade.change(a, b, 0);
    fade.update(1, false);
    expect(a.group.visible).toBe(false);
    a.group.removeFromParent();
    fade.update(1.1, true);
    expect(b.fade).toBe(0);
  });
});
