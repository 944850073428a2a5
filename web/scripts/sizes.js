// Prints gzipped sizes: the add-on with core but without three.js, and the walk page as a whole.
import { readFileSync, readdirSync } from 'node:fs';
import { gzipSync } from 'node:zlib';
import { build } from 'vite';

const root = new URL('..', import.meta.url).pathname;
const kilobytes = (bytes) => `${(bytes / 1000).toFixed(1)} KB`;
const zipped = (data) => gzipSync(data, { level: 9 }).length;

const { output } = (
  await build({
    root,
    configFile: false,
    logLevel: 'error',
    resolve: { conditions: ['farfield-source'] },
    worker: { format: 'es' },
    build: {
      write: false,
      lib: { entry: `${root}packages/three/src/index.ts`, formats: ['es'], fileName: 'farfield' },
      // A library's build keeps its white space; the bundler of a page that uses it does not.
      rolldownOptions: { external: ['three'], output: { minify: true } },
    },
  })
).at(0);
const addOn = output.reduce((sum, { code, source }) => sum + zipped(code ?? source), 0);
console.log(`add-on and core without three.js: ${kilobytes(addOn)}`);

const assets = `${root}app/dist/assets/`;
const page = readFileSync(`${root}app/dist/walk/index.html`);
const whole = readdirSync(assets)
  .filter((name) => name.endsWith('.js'))
  .reduce((sum, name) => sum + zipped(readFileSync(assets + name)), zipped(page));
console.log(`whole app, all scripts: ${kilobytes(whole)}`);
