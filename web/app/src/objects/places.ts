/** Where many stones are, the same in every run. */

/** A small generator of numbers in [0, 1) (mulberry32). */
export function randomNumbers(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

export interface Places {
  readonly places: Float32Array<ArrayBuffer>;
  readonly turns: Float32Array<ArrayBuffer>;
}

function fill(
  count: number,
  at: (random: () => number) => [number, number, number, number],
): Places {
  const random = randomNumbers(7);
  const places = new Float32Array(4 * count);
  const turns = new Float32Array(4 * count);
  for (let n = 0; n < count; n++) {
    places.set(at(random), 4 * n);
    const turn = [0, 1, 2, 3].map(() => random() - 0.5);
    const length = Math.hypot(...turn) || 1;
    turns.set(
      turn.map((x) => x / length),
      4 * n,
    );
  }
  return { places, turns };
}

/** Stones in a ball. */
export function randomPlaces(count: number, radius: number): Places {
  return fill(count, (random) => {
    const height = 2 * random() - 1;
    const angle = 2 * Math.PI * random();
    const away = radius * Math.cbrt(random());
    const flat = Math.sqrt(1 - height * height) * away;
    return [flat * Math.cos(angle), height * away, flat * Math.sin(angle), 0.3 + 0.7 * random()];
  });
}

/** Stones in a flat ring. */
export function ringPlaces(count: number, inner: number, outer: number): Places {
  return fill(count, (random) => {
    const angle = 2 * Math.PI * random();
    const away = Math.sqrt(inner ** 2 + (outer ** 2 - inner ** 2) * random());
    const height = (random() + random() + random() - 1.5) * 0.02 * outer;
    return [away * Math.cos(angle), height, away * Math.sin(angle), 0.15 + 0.5 * random() ** 3];
  });
}
