import { describe, expect, test } from 'vitest';
import {
  InlineBuilder,
  WorkerBuilder,
  answer,
  buildCell,
  type BuildRequest,
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

  postMessage(message: BuildRequest, transfer: ArrayBuffer[]): void {
    const request = structuredClone(message, { transfer });
    const { reply, transfer: back } = answer(request);
    const data = structuredClone(reply, { transfer: back });
    queueMicrotask(() => this.onmessage?.({ data }));
  }

  terminate(): void {
    this.terminated = true;
  }
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
    expect((await builder.near([], [0, 0, 0], [10, 4, 10])).batches).toEqual([]);
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
