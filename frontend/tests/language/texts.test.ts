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

/** Sentences that newcomers did not understand, and what the field says instead. */
const REPLACED: readonly [now: RegExp, better: string][] = [
  [/^(not )?usable( with reservations)?$|^The run is finished/, "results valid, not valid; Run finished"],
  [/hang together|did not hang/, "not connected to the rest, skipped"],
  [
    /^Take (the whole|all)|^Begin in the middle|what I see/,
    "Select whole map, visible area; Start at the map centre",
  ],
  [/^Add all 1 /, "Add 1 neighbour"],
  [/^Point at where/, "Choose the destination of"],
  [/^Further (back|on)$/, "Move back, Move forward"],
  [/^Fill the whole|^Hide the filling/, "Generate traffic, Hide"],
  [/^Place it$|^It cannot be placed$/, "Create scenario, No suitable location"],
  [/^by the others$/, "calculated"],
  [/its own if empty/, "Measured for (default: this actor)"],
  [/^As long as it is true/, "While true"],
  [/Between the bodies/, "Bumper to bumper"],
  [/^At the same time$|^Then another action/, "Add parallel action, Add next action"],
  [/^Gap in the end/, "Final gap"],
  [/^Something does not hold/, "Not (negation)"],
  [/installed package/, "From a plug-in"],
  [/has done rule|began rule/, "completed, triggered"],
  [/suites of tests/, "regression tests"],
  [
    /Numbers to turn|Number that becomes|A number to compute|be a number$/,
    "Value to vary, Link another value, Unlink",
  ],
  [/Least time to collision|Most braking/, "Minimum TTC, Maximum required deceleration"],
  [/^Figures of runs as more/, "Additional result columns"],
  [/Whole page, to keep/, "Download as HTML"],
  [/other chance|^(Runs )?[Aa]t a time$/, "Replications per scenario, Parallel runs"],
  [/ehicles from outside/, "vehicle inputs"],
  [/^Times by rule|^Time it after|volumes ask/, "Signal optimisation, Optimise for demand, protected turns"],
  [/^Make the program the/, "Customise this program"],
  [/^through gaps: it has/, "permissive: shared lane"],
  [/who look for quicker/, "Share of drivers rerouting en route"],
  [
    /that did not dissolve|tranded by a closure|for room to depart/,
    "unresolved queue, blocked by closure, waited to enter",
  ],
  [/^Can(not| only) be said|does not travel|^Left out, though/, "exported approximately, not supported"],
  [/^not held: /i, "constraint not enforced"],
  [/^Resume later$/, "Pause and save"],
  [/(blue|yellow|grey) (points?|one)\b/, "lane, sidewalk: points are drawn only when near"],
  [/^time is .* or more, /, "At t = 0 s"],
];

/** The sentences of a catalogue, and their translations. */
function sentencesOf(catalogue: string): { english: string[]; shown: string[] } {
  const text = readFileSync(join(SOURCES, "locales", catalogue), "utf8");
  const all = (key: string): string[] =>
    [...text.matchAll(new RegExp(`^${key} "(.*)"$`, "gm"))].map(([, one]) => one ?? "");
  return { english: all("msgid"), shown: all("msgstr") };
}

test("no sentence of the page has the words that newcomers did not understand", () => {
  const { english } = sentencesOf("en.po");
  // Reasons of refusals name what a file or a package is to have.
  const server = sentencesOf("server/en.po").english.filter((one) => !/usable|installed package/.test(one));
  const found = [...english, ...server].flatMap((one) =>
    REPLACED.filter(([now]) => now.test(one)).map(([, better]) => `${one}: ${better}`),
  );
  expect(english.length).toBeGreaterThan(2000);
  expect(found).toEqual([]);
});

test("German has the words of the field, too", () => {
  const shown = [...sentencesOf("de.po").shown, ...sentencesOf("server/de.po").shown];
  expect(
    shown.filter((one) => /Startwert|Verhaltensmodell|zum Aufheben|mit anderem Zufall/.test(one)),
  ).toEqual([]);
  for (const one of ["Zufalls-Seed", "Variablen und Variantenläufe", "Keiner", "Ganze Karte auswählen"])
    expect(shown).toContain(one);
});
