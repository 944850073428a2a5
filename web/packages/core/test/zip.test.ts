import { deflateRawSync } from 'node:zlib';
import { describe, expect, it } from 'vitest';
import { ZipSource } from '../src/index.js';

const signal = new AbortController().signal;
const encoder = new TextEncoder();

interface Given {
  readonly name: string;
  readonly data: Uint8Array;
  readonly deflate: boolean;
}

/** Write a zip by hand; `large` uses zip64 for all numbers. */
function zip(files: readonly Given[], large = false, comment = ''): Uint8Array {
  const parts: Uint8Array[] = [];
  const central: Uint8Array[] = [];
  let offset = 0;
  const push = (list: Uint8Array[], bytes: Uint8Array): number => {
    list.push(bytes);
    return bytes.length;
  };
  for (const { name, data, deflate } of files) {
    const title = encoder.encode(name);
    const packed = deflate ? deflateRawSync(data) : data;
    const local = Buffer.alloc(30 + 7);
    local.writeUInt32LE(0x04034b50, 0);
    local.writeUInt16LE(deflate ? 8 : 0, 8);
    local.writeUInt16LE(title.length, 26);
    local.writeUInt16LE(7, 28); // an extra field that the contents do not have
    const begin = offset;
    offset += push(parts, local.subarray(0, 30));
    offset += push(parts, title) + push(parts, local.subarray(30)) + push(parts, packed);
    const extra = Buffer.alloc(large ? 28 : 0);
    const row = Buffer.alloc(46);
    row.writeUInt32LE(0x02014b50, 0);
    row.writeUInt16LE(deflate ? 8 : 0, 10);
    row.writeUInt32LE(large ? 0xffffffff : packed.length, 20);
    row.writeUInt32LE(large ? 0xffffffff : data.length, 24);
    row.writeUInt16LE(title.length, 28);
    row.writeUInt16LE(extra.length, 30);
    row.writeUInt32LE(large ? 0xffffffff : begin, 42);
    if (large) {
      extra.writeUInt16LE(1, 0);
      extra.writeUInt16LE(24, 2);
      [data.length, packed.length, begin].forEach((n, i) =>
        extra.writeBigUInt64LE(BigInt(n), 4 + 8 * i),
      );
    }
    central.push(row, title, extra);
  }
  const size = central.reduce((sum, part) => sum + part.length, 0);
  const tail: Uint8Array[] = [];
  if (large) {
    const record = Buffer.alloc(56);
    record.writeUInt32LE(0x06064b50, 0);
    record.writeBigUInt64LE(BigInt(size), 40);
    record.writeBigUInt64LE(BigInt(offset), 48);
    const locator = Buffer.alloc(20);
    locator.writeUInt32LE(0x07064b50, 0);
    locator.writeBigUInt64LE(BigInt(offset + size), 8);
    tail.push(record, locator);
  }
  const end = Buffer.alloc(22);
  end.writeUInt32LE(0x06054b50, 0);
  end.writeUInt16LE(large ? 0xffff : files.length, 10);
  end.writeUInt32LE(large ? 0xffffffff : size, 12);
  end.writeUInt32LE(large ? 0xffffffff : offset, 16);
  return Buffer.concat([...parts, ...central, ...tail, end, encoder.encode(comment)]);
}

/** A host with one file; `ranges` says whether it answers range requests. */
function host(file: Uint8Array, ranges = true) {
  const asked: string[] = [];
  const fetch = (url: string, init: RequestInit): Promise<Response> => {
    const range = new Headers(init.headers).get('range');
    asked.push(range ?? url);
    if (!ranges || range === null) return Promise.resolve(new Response(Buffer.from(file)));
    const [, first, last] = /^bytes=(\d*)-(\d*)$/.exec(range) ?? [];
    const start = first === '' ? Math.max(0, file.length - Number(last)) : Number(first);
    const stop = first === '' ? file.length : Number(last) + 1;
    return Promise.resolve(new Response(Buffer.from(file.slice(start, stop)), { status: 206 }));
  };
  return { fetch, asked };
}

const FILES: readonly Given[] = [
  { name: 'walk.json', data: encoder.encode('{"a": 1}'.repeat(999)), deflate: true },
  { name: 'atlases/a.png', data: Uint8Array.from({ length: 5000 }, (_, n) => n), deflate: false },
  { name: 'empty', data: new Uint8Array(), deflate: false },
];

describe('ZipSource', () => {
  it.each([
    ['plain', zip(FILES)],
    ['zip64', zip(FILES, true)],
    ['with a comment', zip(FILES, false, 'a comment')],
  ])('reads every file of a %s zip', async (_, file) => {
    const { fetch, asked } = host(file);
    const source = new ZipSource('http://host/walk.zip', fetch);
    for (const { name, data } of FILES) {
      const answer = await source.fetch(`http://host/walk.zip/${name}`, { signal });
      expect(answer.status).toBe(200);
      expect(new Uint8Array(await answer.arrayBuffer())).toEqual(new Uint8Array(data));
    }
    // the contents once, then one request a file
    expect(asked.length).toBeLessThanOrEqual(3 + FILES.length);
    const missing = await source.fetch('http://host/walk.zip/cells/0_0_0.json', { signal });
    expect(missing.status).toBe(404);
  });

  it('leaves other addresses alone', async () => {
    const { fetch, asked } = host(zip(FILES));
    await new ZipSource('http://host/walk.zip', fetch).fetch('http://other/x', { signal });
    expect(asked).toEqual(['http://other/x']);
  });

  it('says what is wrong', async () => {
    const ask = (file: Uint8Array, ranges = true): Promise<Response> =>
      new ZipSource('http://host/w.zip', host(file, ranges).fetch).fetch('http://host/w.zip/a', {
        signal,
      });
    await expect(ask(encoder.encode('no zip at all'))).rejects.toThrow('no zip');
    await expect(ask(zip(FILES), false)).rejects.toThrow('range requests');
  });
});
