import hooks from "eslint-plugin-react-hooks";
import tseslint from "typescript-eslint";

export default tseslint.config(
  {
    ignores: [
      "node_modules",
      "dist",
      "src/api/schema.ts",
      "src/language/serverSentences.ts",
      "src/language/serverTexts.ts",
    ],
  },
  ...tseslint.configs.strict,
  {
    plugins: { "react-hooks": hooks },
    rules: {
      ...hooks.configs.recommended.rules,
      "@typescript-eslint/no-explicit-any": "error",
      // What prettier does not break: texts.
      // A message is one literal, however long it is.
      "max-len": ["error", { code: 119, tabWidth: 2, ignoreTemplateLiterals: true }],
    },
  },
  // Drawings are lines as long as they are; what is generated is as it is generated.
  { files: ["src/map/glyphs.ts", "src/api/schema.ts"], rules: { "max-len": "off" } },
);
