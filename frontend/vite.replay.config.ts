import { defineConfig } from "vite";

// What a run's page that is handed on needs for three dimensions: one script, beside the built page.
export default defineConfig({
  publicDir: false,
  define: { "process.env.NODE_ENV": JSON.stringify("production") },
  build: {
    outDir: "../src/odscen/web/static/replay",
    emptyOutDir: true,
    target: "es2022",
    chunkSizeWarningLimit: 900,
    lib: {
      entry: "src/replay/page.ts",
      formats: ["iife"],
      name: "odscenScenery",
      fileName: () => "scenery.js",
    },
  },
});
