// Sends a file with tus-js-client and breaks off again and again: at each of the given numbers of
// bytes the upload is aborted, a new one is made as a restarted client would, and it goes on.
//   node tus_client.mjs ENDPOINT FILE CHUNK BREAK...
import { createReadStream, statSync } from 'node:fs';
import { createRequire } from 'node:module';
import { basename } from 'node:path';

const require = createRequire(process.env.FARFIELD_TUS_FROM);
const { Upload } = require('tus-js-client');

const [endpoint, file, chunk, ...breaks] = process.argv.slice(2);
const size = statSync(file).size;
let url = null;
let resumed = 0;

function attempt(breakAt) {
  return new Promise((resolve, reject) => {
    const input = createReadStream(file);
    const upload = new Upload(input, {
      endpoint,
      uploadUrl: url,
      uploadSize: size,
      chunkSize: Number(chunk),
      retryDelays: [0, 100, 200, 400, 800, 1600],
      metadata: { filename: basename(file) },
      onProgress: (sent) => {
        if (breakAt === undefined || sent < breakAt) return;
        breakAt = undefined;
        upload.abort().then(() => {
          url = upload.url;
          input.destroy();
          resolve(false);
        }, reject);
      },
      onSuccess: () => {
        url = upload.url;
        resolve(true);
      },
      onError: reject,
    });
    if (url !== null) resumed += 1;
    upload.start();
  });
}

let done = false;
for (const at of breaks.map(Number)) {
  done = await attempt(at);
  if (done) break;
}
if (!done) await attempt(undefined);
console.log(JSON.stringify({ url, resumed, done }));
process.exit(0); // connections that were kept alive would hold it for minutes
