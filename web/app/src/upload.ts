/** Sending a model: resumable, and followed until it is a scene. */

import { Upload } from 'tus-js-client';
import { apiAddress, get, sentenceOf, tell, type UploadStatus } from './api.js';

/** Bytes sent in one request; a broken connection costs at most the part not yet received. */
const CHUNK = 32 * 2 ** 20;
const RETRIES = [0, 500, 1000, 3000, 5000, 10000];

export interface Sending {
  readonly sent: number;
  readonly total: number;
  readonly arrived: boolean;
}

/** Send a file; resolves with the id of its scene. */
export async function sendModel(
  file: File,
  onProgress: (sending: Sending) => void,
  signal: AbortSignal,
): Promise<string> {
  const url = await send(file, onProgress, signal);
  onProgress({ sent: file.size, total: file.size, arrived: true });
  const id = new URL(url).pathname.split('/').pop() ?? '';
  for (;;) {
    const status = await get<UploadStatus>(`uploads/${id}`, signal);
    if (status.state === 'done' && status.scene !== null) return status.scene;
    if (status.state === 'refused') throw new Error(status.reason ?? 'The model was refused.');
    await new Promise((resolve) => setTimeout(resolve, 150));
  }
}

async function send(
  file: File,
  onProgress: (sending: Sending) => void,
  signal: AbortSignal,
): Promise<string> {
  return new Promise((resolve, reject) => {
    const upload = new Upload(file, {
      endpoint: apiAddress('uploads'),
      chunkSize: CHUNK,
      retryDelays: RETRIES,
      metadata: { filename: file.name },
      removeFingerprintOnSuccess: true,
      onProgress: (sent, total) => onProgress({ sent, total, arrived: false }),
      onError: (error) => {
        const response = 'originalResponse' in error ? error.originalResponse : null;
        reject(
          new Error(
            response === null ? tell(error) : sentenceOf(response.getStatus(), response.getBody()),
          ),
        );
      },
      onSuccess: () => resolve(upload.url ?? ''),
    });
    signal.addEventListener('abort', () => {
      void upload.abort();
      reject(new DOMException('The upload was stopped.', 'AbortError'));
    });
    // the same file, chosen again after a break, goes on where it stopped
    upload.findPreviousUploads().then(
      (before) => {
        if (before.length > 0) upload.resumeFromPreviousUpload(before[0]);
        upload.start();
      },
      () => upload.start(),
    );
  });
}
