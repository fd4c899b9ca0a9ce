import { defineConfig } from "@lingui/cli";
import { formatter } from "@lingui/format-po";

const SENTENCES = "src/language/serverSentences.ts";

/**
 * The English texts stand in the code; `npm run texts` collects them into the catalogues. Sentences
 * of the server have a file of their own beside those of the page, as it is loaded after them.
 */
export default defineConfig({
  sourceLocale: "en",
  locales: ["en", "de"],
  catalogs: [
    { path: "<rootDir>/src/locales/{locale}", include: ["src"], exclude: ["src/api/schema.ts", SENTENCES] },
    { path: "<rootDir>/src/locales/server/{locale}", include: [SENTENCES] },
  ],
  format: formatter({ lineNumbers: false }),
  orderBy: "message",
});
