import { lingui } from "@lingui/vite-plugin";
import react from "@vitejs/plugin-react";
import { defineConfig } from "vitest/config";

// The built page is part of the Python package; `odscen serve` answers /api, in development too.
const server = process.env.ODSCEN_SERVER ?? "http://127.0.0.1:8765";

export default defineConfig({
  base: "./",
  plugins: [
    react({ babel: { plugins: [["@lingui/babel-plugin-lingui-macro", { descriptorFields: "message" }]] } }),
    lingui(),
  ],
  build: {
    outDir: "../src/odscen/web/static",
    emptyOutDir: true,
    target: "es2022",
    chunkSizeWarningLimit: 900,
  },
  // Pictures of signal programs have one style, beside the code that draws them for reports.
  server: { fs: { allow: [".."] }, proxy: { "/api": { target: server, ws: true, changeOrigin: true } } },
  test: {
    include: ["tests/**/*.test.{ts,tsx}"],
    setupFiles: ["tests/english.ts"],
    environment: "node",
    testTimeout: 30_000,
  },
});
