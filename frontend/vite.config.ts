import { lingui } from "@lingui/vite-plugin";
import react from "@vitejs/plugin-react";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { brotliCompressSync } from "node:zlib";
import { defineConfig } from "vitest/config";

// The built page is part of the Python package; `odscen serve` answers /api, in development too.
const server = process.env.ODSCEN_SERVER ?? "http://127.0.0.1:8765";

const built = "../src/odscen/web/static";

/** Packed once, by the best means, for browsers that take it; the server packs for the others. */
const packed = {
  name: "packed",
  closeBundle(): void {
    for (const name of readdirSync(join(built, "assets"))) {
      const file = join(built, "assets", name);
      if (/\.(js|css|svg)$/.test(name)) writeFileSync(`${file}.br`, brotliCompressSync(readFileSync(file)));
    }
  },
};

export default defineConfig({
  base: "./",
  plugins: [
    react({ babel: { plugins: [["@lingui/babel-plugin-lingui-macro", { descriptorFields: "message" }]] } }),
    lingui(),
    { ...packed, apply: "build" },
  ],
  build: {
    outDir: built,
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
