import { defineConfig } from 'vite';

// The program of reports is one script and one style sheet, which the service writes into each report.
export default defineConfig({
  build: {
    target: 'es2022',
    emptyOutDir: true,
    outDir: '../api/built_page/report',
    assetsInlineLimit: 0,
    cssCodeSplit: false,
    modulePreload: false,
    reportCompressedSize: false,
    chunkSizeWarningLimit: 2000,
    rolldownOptions: {
      input: 'src/report/main.tsx',
      output: { format: 'es', codeSplitting: false, entryFileNames: 'report.js', assetFileNames: 'report[extname]' },
    },
  },
});
