import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";

import ts from "typescript";
import { expect, test } from "vitest";

const SOURCES = join(__dirname, "../../src");
/** Properties whose value a reader sees or hears. */
const SHOWN = new RegExp(
  "^(label|title|placeholder|description|alt|note|hint|word|earlier|removal|action|[xy]Label|thumbLabel" +
    "|closeButtonLabel|nothingFoundMessage|aria-(label|description|roledescription|valuetext))$",
);
/** Names, signs of units and what is typed as it is have no translation. */
const SAME =
  /^[^A-Za-z]*$|^[\d.]+ (min|×)$|^(odscen|CARLA|GEH|SUMO|OpenSCENARIO|GraphML|EGO|MB|s|km|Ctrl\+[A-Z])$/;

/** Texts that are shown as they stand in the code, in whatever language the page is. */
function bare(path: string, text = readFileSync(path, "utf8")): string[] {
  const source = ts.createSourceFile(path, text, ts.ScriptTarget.Latest, true);
  const found: string[] = [];
  const say = (node: ts.Node, text: string): void => {
    if (SAME.test(text.trim())) return;
    const { line } = source.getLineAndCharacterOfPosition(node.getStart());
    found.push(`${path.slice(SOURCES.length + 1)}:${line + 1} ${text.replace(/\s+/g, " ").trim()}`);
  };
  const visit = (node: ts.Node, translated: boolean): void => {
    if (ts.isJsxText(node) && !translated) say(node, node.text);
    if (ts.isJsxAttribute(node) && SHOWN.test(node.name.getText()) && node.initializer)
      if (ts.isStringLiteral(node.initializer)) say(node, node.initializer.text);
    if (ts.isPropertyAssignment(node) && SHOWN.test(node.name.getText()))
      if (ts.isStringLiteralLike(node.initializer) && node.name.getText() !== "action")
        say(node, node.initializer.text);
    const inside = translated || (ts.isJsxElement(node) && node.openingElement.tagName.getText() === "Trans");
    ts.forEachChild(node, (child) => visit(child, inside));
  };
  visit(source, false);
  return found;
}

test("no text of the page stands outside the catalogue", () => {
  const files = readdirSync(SOURCES, { recursive: true, encoding: "utf8" });
  const sources = files.filter((file) => /\.tsx?$/.test(file) && !file.endsWith("schema.ts"));
  expect(sources.length).toBeGreaterThan(200);
  expect(sources.flatMap((file) => bare(join(SOURCES, file)))).toEqual([]);
});

test("a text that is not marked is found", () => {
  const here = join(SOURCES, "ui/part.tsx");
  const said = (text: string): number => bare(here, `const part = ${text};`).length;
  expect(said("<p>Hello</p>")).toBe(1);
  expect(said('<Field label="Name" />')).toBe(1);
  expect(said('{ value: "car", label: "Car" }')).toBe(1);
  expect(said("<p><Trans>Hello <b>you</b></Trans></p>")).toBe(0);
  expect(said('<Field label={t`Name`} unit="km" />')).toBe(0);
});
