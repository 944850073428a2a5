// Packs both packages as npm would publish them, installs them beside three.js, checks the types of the
// examples against them and builds the examples: node scripts/build-examples.js OUT
import { execFileSync } from 'node:child_process';
import {
  cpSync,
  mkdirSync,
  mkdtempSync,
  readdirSync,
  rmSync,
  symlinkSync,
  writeFileSync,
} from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'vite';

const root = fileURLToPath(new URL('..', import.meta.url));
const out = resolve(process.argv[2] ?? join(root, 'examples/dist'));
const work = mkdtempSync(join(tmpdir(), 'farfield-examples-'));
const run = (command, ...args) =>
  execFileSync(command, args, { cwd: root, stdio: ['ignore', 'pipe', 'inherit'] });

try {
  for (const name of ['core', 'three']) {
    const folder = join(root, 'packages', name);
    rmSync(join(folder, 'dist'), { recursive: true, force: true });
    run('npm', 'run', 'build', '--silent', '-w', `@farfield/${name}`);
    const [{ filename, files }] = JSON.parse(
      run('npm', 'pack', folder, '--json', '--pack-destination', work),
    );
    const strays = files.filter(
      ({ path }) => !/^(dist\/.*\.(js|d\.ts)|package\.json|README\.md|LICENSE)$/.test(path),
    );
    if (strays.length > 0) throw new Error(`${name} would publish ${strays[0].path}.`);
    const target = join(work, 'node_modules/@farfield', name);
    mkdirSync(target, { recursive: true });
    run('tar', '-xzf', join(work, filename), '-C', target, '--strip-components=1');
  }
  mkdirSync(join(work, 'node_modules/@types'));
  for (const name of ['three', '@types/three', '@types/webxr', '@webgpu/types']) {
    mkdirSync(join(work, 'node_modules', name, '..'), { recursive: true });
    symlinkSync(join(root, 'node_modules', name), join(work, 'node_modules', name));
  }
  const names = readdirSync(join(root, 'examples'), { withFileTypes: true })
    .filter((entry) => entry.isDirectory() && entry.name !== 'dist')
    .map(({ name }) => name);
  for (const name of names)
    cpSync(join(root, 'examples', name), join(work, name), { recursive: true });
  cpSync(join(root, 'tsconfig.base.json'), join(work, 'tsconfig.base.json'));
  writeFileSync(
    join(work, 'tsconfig.json'),
    JSON.stringify({
      extends: './tsconfig.base.json',
      compilerOptions: { noEmit: true, skipLibCheck: false },
      include: ['*/main.ts'],
    }),
  );
  writeFileSync(join(work, 'package.json'), '{"type": "module"}');
  run(process.execPath, join(root, 'node_modules/typescript/bin/tsc'), '-p', work);
  await build({
    root: work,
    base: './',
    configFile: false,
    logLevel: 'error',
    worker: { format: 'es' },
    build: {
      outDir: out,
      emptyOutDir: true,
      target: 'es2022',
      chunkSizeWarningLimit: 1000,
      rolldownOptions: { input: names.map((name) => join(work, name, 'index.html')) },
    },
  });
} finally {
  rmSync(work, { recursive: true, force: true });
}
