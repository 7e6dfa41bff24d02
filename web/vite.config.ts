import { defineConfig } from 'vite';

export default defineConfig({
  base: './', // the page works under any path prefix
  build: {
    target: 'es2022',
    emptyOutDir: true,
    outDir: '../api/built_page',
    assetsInlineLimit: 0, // the Content-Security-Policy lets no data: scripts or styles in
    modulePreload: { polyfill: false },
    reportCompressedSize: false,
    chunkSizeWarningLimit: 1000,
  },
  server: { proxy: { '/v1': 'http://127.0.0.1:8000', '/readyz': 'http://127.0.0.1:8000' } },
});
