/** The server's list of bakes, read with care: a page must not break on an unknown answer. */

export interface Bake {
  readonly id: string;
  readonly name: string;
  readonly scene: string;
  readonly progress: string;
}

/** Read a list, or a list under "bakes" or "items"; entries without an id are left out. */
export function readBakes(answer: unknown): Bake[] {
  const list = Array.isArray(answer)
    ? answer
    : (member(answer, 'bakes') ?? member(answer, 'items'));
  if (!Array.isArray(list)) return [];
  return list.flatMap((entry: unknown) => {
    const id = member(entry, 'id');
    if (typeof id !== 'string') return [];
    const name = member(entry, 'name');
    const scene = member(entry, 'scene');
    const cells = member(entry, 'cells');
    const [done, total] = [member(cells, 'done'), member(cells, 'total')];
    return [
      {
        id,
        name: typeof name === 'string' && name !== '' ? name : id,
        scene: typeof scene === 'string' ? scene : '',
        progress:
          typeof done === 'number' && typeof total === 'number'
            ? done < total
              ? `${done} of ${total} cells`
              : `${total} cells`
            : '',
      },
    ];
  });
}

function member(value: unknown, name: string): unknown {
  return typeof value === 'object' && value !== null
    ? (value as Record<string, unknown>)[name]
    : undefined;
}
