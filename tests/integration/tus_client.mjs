// Sends a file with tus-js-client, which goes on by itself whenever the connection breaks.
//   node tus_client.mjs ENDPOINT FILE CHUNK
import { createReadStream, statSync } from 'node:fs';
import { createRequire } from 'node:module';
import { basename } from 'node:path';

const require = createRequire(process.env.FARFIELD_TUS_FROM);
const { Upload } = require('tus-js-client');

const [endpoint, file, chunk] = process.argv.slice(2);
let resumed = 0;

const upload = new Upload(createReadStream(file), {
  endpoint,
  uploadSize: statSync(file).size,
  chunkSize: Number(chunk),
  retryDelays: new Array(60).fill(50),
  metadata: { filename: basename(file) },
  onBeforeRequest: (request) => {
    if (request.getMethod() === 'HEAD') resumed += 1;
  },
  onSuccess: () => {
    console.log(JSON.stringify({ url: upload.url, resumed }));
    process.exit(0); // connections that were kept alive would hold it for minutes
  },
  onError: (error) => {
    console.error(String(error));
    process.exit(1);
  },
});
upload.start();
