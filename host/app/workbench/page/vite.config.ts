import { defineConfig } from "vite";

// One script and one style with plain names: CMake embeds them. Bytes must not depend on the machine that builds.
export default defineConfig({
  base: "./",
  build: {
    outDir: "built",
    emptyOutDir: true,
    target: "es2021",
    modulePreload: false,
    assetsInlineLimit: 0,
    rollupOptions: { output: { entryFileNames: "page.js", assetFileNames: "page[extname]" } },
  },
});
