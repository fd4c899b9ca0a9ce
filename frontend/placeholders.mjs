// Fails where a translation inserts something else than its text does, or has other marks.
import { readFileSync } from "node:fs";

import { formatter } from "@lingui/format-po";
import { compileMessage } from "@lingui/message-utils/compileMessage";

import config from "./lingui.config.ts";

/** Names of what a compiled message inserts, in its plurals too, and its tags. */
function inserted(message) {
  const found = new Set(message.match(/<\/?\d+\/?>/g) ?? []);
  const visit = (token) => {
    if (typeof token === "string") return;
    const [name, , forms] = token;
    found.add(`{${name}}`);
    for (const form of Object.values(forms ?? {})) if (Array.isArray(form)) form.forEach(visit);
  };
  const compiled = compileMessage(message);
  if (Array.isArray(compiled)) compiled.forEach(visit);
  return [...found].sort().join(" ");
}

let wrong = 0;
for (const { path } of config.catalogs) {
  for (const locale of config.locales) {
    if (locale === config.sourceLocale) continue;
    const file = `${path.replace("<rootDir>/", "").replace("{locale}", locale)}.po`;
    const catalogue = await formatter().parse(readFileSync(file, "utf8"), { locale });
    for (const { message, translation } of Object.values(catalogue)) {
      const [wanted, has] = [inserted(message), inserted(translation)];
      if (!translation || wanted === has) continue;
      wrong += 1;
      console.error(
        `${file}: ${JSON.stringify(translation)} inserts ${has || "nothing"}, not ${wanted || "nothing"}`,
      );
    }
  }
}
process.exit(wrong > 0 ? 1 : 0);
