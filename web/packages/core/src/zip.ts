/**
 * A walk in one zip, read with range requests: the contents once, then each file by itself.
 * Sections are those of the zip specification, APPNOTE 6.3.10.
 */

import { FarfieldError } from './errors.js';

type Fetch = (url: string, init: RequestInit) => Promise<Response>;

interface Entry {
  readonly method: number;
  readonly offset: number;
  readonly size: number;
}

/** The end record and the longest comment (4.3.16). */
const TAIL = 22 + 65535;
const STORED = 0;
const DEFLATED = 8;
/** Local headers repeat the name and may have other extra fields (4.3.7). */
const LOCAL = 30;

/** Serves addresses below `<zip>/` out of the zip, all others as `fetch` does. */
export class ZipSource {
  private readonly url: string;
  private readonly plain: Fetch;
  private contents: Promise<Map<string, Entry>> | undefined;

  constructor(url: string, plain: Fetch = (address, init) => fetch(address, init)) {
    this.url = url;
    this.plain = plain;
  }

  /** Where the manifest seems to lie. */
  get manifestUrl(): string {
    return `${this.url}/walk.json`;
  }

  readonly fetch = async (url: string, init: { signal: AbortSignal }): Promise<Response> => {
    if (!url.startsWith(`${this.url}/`)) return this.plain(url, init);
    const name = decodeURIComponent(url.slice(this.url.length + 1));
    // whoever asks first may call off; the contents are for all
    this.contents ??= this.readContents().catch((error: unknown) => {
      this.contents = undefined;
      throw error;
    });
    const entry = (await this.contents).get(name);
    if (entry === undefined) return new Response(null, { status: 404 });
    const length = LOCAL + 2 * name.length + 256 + entry.size;
    const bytes = await this.range(`bytes=${entry.offset}-${entry.offset + length - 1}`, init);
    const view = new DataView(bytes);
    if (bytes.byteLength < LOCAL || view.getUint32(0, true) !== 0x04034b50) throw this.damaged();
    const start = LOCAL + view.getUint16(26, true) + view.getUint16(28, true);
    const data = bytes.slice(start, start + entry.size);
    if (data.byteLength !== entry.size) throw this.damaged();
    if (entry.method === STORED) return new Response(data);
    const inflated = new Blob([data]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
    return new Response(inflated);
  };

  private async readContents(): Promise<Map<string, Entry>> {
    const init = { signal: new AbortController().signal };
    const tail = await this.range(`bytes=-${TAIL}`, init);
    const view = new DataView(tail);
    let at = tail.byteLength - 22;
    while (at >= 0 && view.getUint32(at, true) !== 0x06054b50) at -= 1;
    if (at < 0) throw this.damaged();
    let size = view.getUint32(at + 12, true);
    let offset = view.getUint32(at + 16, true);
    if (offset === 0xffffffff || size === 0xffffffff || view.getUint16(at + 10, true) === 0xffff) {
      // zip64: the locator stands before, and says where the other end record is (4.3.15, 4.3.14)
      if (at < 20 || view.getUint32(at - 20, true) !== 0x07064b50) throw this.damaged();
      const where = Number(view.getBigUint64(at - 12, true));
      const end = new DataView(await this.range(`bytes=${where}-${where + 55}`, init));
      if (end.byteLength < 56 || end.getUint32(0, true) !== 0x06064b50) throw this.damaged();
      size = Number(end.getBigUint64(40, true));
      offset = Number(end.getBigUint64(48, true));
    }
    const table = await this.range(`bytes=${offset}-${offset + size - 1}`, init);
    return this.parse(new DataView(table));
  }

  /** The central directory (4.3.12). */
  private parse(view: DataView<ArrayBuffer>): Map<string, Entry> {
    const entries = new Map<string, Entry>();
    const text = new TextDecoder();
    let at = 0;
    while (at + 46 <= view.byteLength && view.getUint32(at, true) === 0x02014b50) {
      const method = view.getUint16(at + 10, true);
      let size = view.getUint32(at + 20, true);
      const whole = view.getUint32(at + 24, true);
      const [name, extra, comment] = [28, 30, 32].map((place) => view.getUint16(at + place, true));
      let offset = view.getUint32(at + 42, true);
      const title = text.decode(new Uint8Array(view.buffer, at + 46, name));
      const end = at + 46 + name + extra;
      for (let field = at + 46 + name; field + 4 <= end;) {
        if (view.getUint16(field, true) === 1) {
          // zip64 extra (4.5.3): what does not fit above, in this order
          let place = field + 4;
          const next = (): number => Number(view.getBigUint64((place += 8) - 8, true));
          if (whole === 0xffffffff) next();
          if (size === 0xffffffff) size = next();
          if (offset === 0xffffffff) offset = next();
        }
        field += 4 + view.getUint16(field + 2, true);
      }
      if (method !== STORED && method !== DEFLATED) throw this.damaged();
      entries.set(title, { method, offset, size });
      at = end + comment;
    }
    return entries;
  }

  private async range(range: string, init: RequestInit): Promise<ArrayBuffer> {
    const answer = await this.plain(this.url, { ...init, headers: { Range: range } });
    if (answer.status === 200) {
      throw new FarfieldError(
        'network',
        `${this.url} came whole; its host has to answer range requests.`,
      );
    }
    if (answer.status !== 206) {
      throw new FarfieldError(
        answer.status === 404 ? 'not-found' : 'network',
        `${this.url} answered ${answer.status}.`,
      );
    }
    return answer.arrayBuffer();
  }

  private damaged(): FarfieldError {
    return new FarfieldError('format', `${this.url} is no zip with a walk in it.`);
  }
}
