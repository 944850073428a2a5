import { defineConfig } from 'vite';

// Relative addresses, and the walk page in a folder of its own: /walk/<id> on a server and
// walk/index.html?walk=... in any folder of a static host both find their assets at ../assets.
export default defineConfig({
  base: './',
  resolve: { conditions: ['farfield-source', 'module', 'browser', 'import', 'default'] },
  oxc: { jsx: { runtime: 'automatic', importSource: 'preact' } },
  worker: { format: 'es' },
  build: {
    target: 'es2022',
    chunkSizeWarningLimit: 600, // three.js in one piece
    rolldownOptions: {
      input: {
        index: 'index.html',
        scene: 'scene/index.html',
        bake: 'bake/index.html',
        walk: 'walk/index.html',
        objects: 'objects/index.html',
      },
      output: {
        codeSplitting: { groups: [{ name: 'three', test: /node_modules\/three\/build\// }] },
      },
    },
  },
});
