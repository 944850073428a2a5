import { describe, expect, test } from 'vitest';
import { makeGlb } from './glb-maker.js';
import {
  Answerer,
  InlineBuilder,
  WorkerBuilder,
  buildCell,
  type BuildRequest,
  type BuiltNear,
  type CellBuilder,
  type NearSource,
} from '../src/index.js';

const CELL = {
  format: 'farfield-cell',
  version: 1,
  cell: [0, 0, 0],
  eyes: [[1, 2, 3]],
  quads: {
    eyes: [0],
    faces: [0],
    layers: [0],
    corner_counts: [3],
    corners: [0, 0, 8, 0, 8, 8],
    planes: [0, 0, 0.1],
    pages: [0],
    scales: [1],
    offsets: [0, 0],
    turned: [0],
  },
  atlases: ['a.png'],
  near: [{ blob: 'n.glb', ranges: [0, 0, 1] }],
  figures: {},
};

const encode = (value: unknown): ArrayBuffer =>
  new TextEncoder().encode(JSON.stringify(value)).buffer;

/** A worker without a thread: messages are copied, as between threads. */
class FakeWorker {
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onerror: ((event: object) => void) | null = null;
  terminated = false;
  readonly answerer = new Answerer();

  postMessage(message: BuildRequest, transfer: ArrayBuffer[]): void {
    const request = structuredClone(message, { transfer });
    const { reply, transfer: back } = this.answerer.answer(request);
    const data = structuredClone(reply, { transfer: back });
    queueMicrotask(() => this.onmessage?.({ data }));
  }

  terminate(): void {
    this.terminated = true;
  }
}

/** A block of one triangle at some x. */
function triangle(x: number): ArrayBuffer {
  const positions = new Float32Array([x, 0, 0, x, 1, 0, x, 0, 1]);
  return makeGlb(
    { nodes: [{ mesh: 0 }], meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }] },
    [{ data: positions, componentType: 5126, type: 'VEC3', count: 3 }],
  );
}

async function nearField(builder: CellBuilder, sources: readonly NearSource[]): Promise<BuiltNear> {
  const near = builder.near([0, 0, 0], [10, 4, 10]);
  for (const source of sources) await near.add(source);
  return near.finish();
}

describe('builders', () => {
  test('read a cell file', () => {
    const built = buildCell(encode(CELL), 64);
    expect(built.centre).toEqual([1, 2, 3]);
    expect(built.atlases).toEqual(['a.png']);
    expect(built.near).toEqual(CELL.near);
    expect(built.far.quads).toBe(1);
  });

  test('the worker’s answer is the same as one made here, and the bytes are handed over', async () => {
    const worker = new FakeWorker();
    const builder = new WorkerBuilder(worker as unknown as Worker);
    const bytes = encode(CELL);
    const remote = await builder.cell(bytes, 64);
    expect(bytes.byteLength).toBe(0);
    expect(remote).toEqual(await new InlineBuilder().cell(encode(CELL), 64));
  });

  test('near fields are built side by side, the same there as here', async () => {
    const sources = [1, 2, 3].map((x) => ({ bytes: triangle(x), ranges: [0, 0, 1] }));
    const worker = new FakeWorker();
    const remote = new WorkerBuilder(worker as unknown as Worker);
    const here = new InlineBuilder();
    const [a, b] = await Promise.all([
      nearField(remote, sources),
      nearField(remote, sources.slice(1)),
    ]);
    expect(a).toEqual(await nearField(here, sources));
    expect(b).toEqual(await nearField(here, sources.slice(1)));
    expect(a.batches[0].indices).toHaveLength(9);
    expect((await remote.near([0, 0, 0], [10, 4, 10]).finish()).batches).toEqual([]);
    // The blocks stay the caller's.
    expect(sources.every(({ bytes }) => bytes.byteLength > 0)).toBe(true);
  });

  test('a near field that is called off, or of a bad block, leaves nothing behind', async () => {
    const worker = new FakeWorker();
    const builder = new WorkerBuilder(worker as unknown as Worker);
    const near = builder.near([0, 0, 0], [10, 4, 10]);
    await near.add({ bytes: triangle(1), ranges: [0, 0, 1] });
    await expect(near.add({ bytes: triangle(1), ranges: [0, 0, 2] })).rejects.toThrow('not have');
    expect(worker.answerer.building).toBe(1);
    near.cancel();
    near.cancel();
    await nearField(builder, []);
    expect(worker.answerer.building).toBe(0);
    const inline = new InlineBuilder().near([0, 0, 0], [10, 4, 10]);
    await expect(inline.add({ bytes: new ArrayBuffer(4), ranges: [] })).rejects.toThrow('glTF');
  });

  test.each([
    ['not JSON', new TextEncoder().encode('oops').buffer],
    ['not of the version', encode({ ...CELL, version: 2 })],
    ['not of the version', encode({ ...CELL, format: 'x' })],
  ])('what is wrong comes back in words: %s', async (says, bytes) => {
    const builder = new WorkerBuilder(new FakeWorker() as unknown as Worker);
    await expect(builder.cell(bytes, 64)).rejects.toThrow(says);
    await expect(builder.cell(encode({ ...CELL, eyes: undefined }), 64)).rejects.toThrow(Error);
  });

  test('a builder that is disposed of answers nobody', async () => {
    const worker = new FakeWorker();
    const builder = new WorkerBuilder(worker as unknown as Worker);
    const waiting = builder.cell(encode(CELL), 64);
    builder.dispose();
    await expect(waiting).rejects.toThrow('called off');
    expect(worker.terminated).toBe(true);
  });

  test('a worker that dies fails what waits', async () => {
    const worker = new FakeWorker();
    const builder = new WorkerBuilder(worker as unknown as Worker);
    const waiting = builder.cell(encode(CELL), 64);
    worker.onerror?.({ message: 'out of memory', preventDefault: () => undefined });
    await expect(waiting).rejects.toThrow('out of memory');
  });
});
