import { defineConfig } from 'vitest/config';

export default defineConfig({
  resolve: { conditions: ['farfield-source'] },
  ssr: { resolve: { conditions: ['farfield-source'] } },
  test: {
    include: ['packages/*/test/**/*.test.ts', 'app/test/**/*.test.ts'],
    environment: 'node',
    testTimeout: 30_000,
  },
});
