/** Makes small GLBs for tests. */

export interface Buffer {
  readonly data: ArrayBufferView;
  readonly componentType: number;
  readonly type: string;
  readonly count: number;
  readonly normalized?: boolean;
  readonly byteStride?: number;
}

/** A GLB of `root` with one accessor, in a view of its own, for each of `buffers`. */
export function makeGlb(root: object, buffers: readonly Buffer[]): ArrayBuffer {
  const parts: Uint8Array[] = [];
  let length = 0;
  const bufferViews = buffers.map(({ data, byteStride }) => {
    const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
    const padded = new Uint8Array(Math.ceil(bytes.length / 4) * 4);
    padded.set(bytes);
    parts.push(padded);
    const view = {
      buffer: 0,
      byteOffset: length,
      byteLength: bytes.length,
      ...(byteStride !== undefined && { byteStride }),
    };
    length += padded.length;
    return view;
  });
  const accessors = buffers.map(({ componentType, type, count, normalized }, n) => ({
    bufferView: n,
    componentType,
    type,
    count,
    ...(normalized === true && { normalized }),
  }));
  const json = { asset: { version: '2.0' }, bufferViews, accessors, ...root };
  let text = JSON.stringify({ buffers: [{ byteLength: length }], ...json });
  text += ' '.repeat((4 - (text.length % 4)) % 4);
  const total = 12 + 8 + text.length + 8 + length;
  const glb = new Uint8Array(total);
  const view = new DataView(glb.buffer);
  const header = [0x46546c67, 2, total, text.length, 0x4e4f534a];
  header.forEach((value, n) => view.setUint32(4 * n, value, true));
  glb.set(new TextEncoder().encode(text), 20);
  view.setUint32(20 + text.length, length, true);
  view.setUint32(24 + text.length, 0x004e4942, true);
  let at = 28 + text.length;
  for (const part of parts) {
    glb.set(part, at);
    at += part.length;
  }
  return glb.buffer;
}
