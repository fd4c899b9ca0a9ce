import { defineConfig } from "@lingui/cli";
import { formatter } from "@lingui/format-po";

/** The English texts stand in the code; `npm run texts` collects them into the catalogues. */
export default defineConfig({
  sourceLocale: "en",
  locales: ["en", "de"],
  catalogs: [{ path: "<rootDir>/src/locales/{locale}", include: ["src"], exclude: ["src/api/schema.ts"] }],
  format: formatter({ lineNumbers: false }),
  orderBy: "message",
});
