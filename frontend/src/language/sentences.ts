import { i18n, type MessageDescriptor } from "@lingui/core";
import { t } from "@lingui/core/macro";

import { SERVER_SENTENCES } from "./serverSentences";

/** A sentence of the server: its text between what it inserts, and the names of that. */
interface Template {
  descriptor: MessageDescriptor;
  pattern: RegExp;
  names: readonly string[];
  /** The longest text in it, which is looked for first. */
  core: string;
  /** How many of its values can be numbers only. */
  counted: number;
  /** Letters of its own; of several templates that fit, the one with the most is meant. */
  weight: number;
  /** Its length with everything else in it. */
  length: number;
}

/** So few letters say little: what they part must be single words. */
const LITTLE = 8;
/** What may be before a sentence that continues another. */
const JOINT = /^[\s;,]+(?:- )?/;
/** Between sentences that stand in one; where all parts must be known, and where the last one only. */
const BETWEEN = ["; ", ". ", ", ", " and "];
/** Placeholders whose words are names given by the user, not words of the server. */
const GIVEN = /^(id|names?|file|actor|segment|node|text|key|path|map_name)\d*$/;
/** What is put in quotes, or a number: in a list of them there are no words. */
const DATUM = /^'[^']*'$|^-?[\d.,]*\d$/;
const NUMBER = /^-?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?$/;
/** No sentence of people is nested deeper. */
const DEEPEST = 4;

/** A `line 3` is one of a table, with the number of its line; a `line 'M3'` is one of buses, with its id. */
const COUNTED = /^(number|line_num|lineno|lines)$/;
/** A value that another follows at once ends where its quotes do, or where that begins. */
const BEFORE = String.raw`('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"|.*?)`;
const AFTER = String.raw`((?:[\s;,(].*)?)`;

const quoted = (text: string): string => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

/** The parts of a message: text, name, text, ...; an apostrophe is doubled before a brace only. */
export const partsOf = (message: string): string[] =>
  message.split(/\{(\w+)\}/).map((part, n) => (n % 2 ? part : part.replace(/''$/, "'")));

function template(descriptor: MessageDescriptor): Template {
  const parts = partsOf(descriptor.message ?? "");
  const texts = parts.filter((_, n) => n % 2 === 0);
  const names = parts.filter((_, n) => n % 2 === 1);
  const weight = texts.join("").replace(/[^\p{L}]/gu, "").length;
  const counts = (name: string, n: number): boolean =>
    COUNTED.test(name) && (parts[n - 1] ?? "").endsWith("line ");
  const value = (name: string, n: number): string => {
    if (counts(name, n)) return "([\\d.,]+)";
    if (n > 1 && parts[n - 1] === "") return AFTER;
    if (n + 2 < parts.length && parts[n + 1] === "") return BEFORE;
    return weight < LITTLE ? "(\\S+)" : "(.*?)";
  };
  return {
    descriptor,
    pattern: new RegExp(`^${parts.map((part, n) => (n % 2 ? value(part, n) : quoted(part))).join("")}$`),
    names,
    core: texts.reduce((a, b) => (b.length > a.length ? b : a), ""),
    counted: parts.filter((part, n) => n % 2 && counts(part, n)).length,
    weight,
    length: texts.join("").length,
  };
}

const order = (a: Template, b: Template): number =>
  b.weight - a.weight || b.length - a.length || b.counted - a.counted || a.names.length - b.names.length;
let templates: readonly Template[] | null = null;

/**
 * A sentence of the server in the language of the reader; what is not known stays as it is.
 *
 * Sentences may be in each other, one after the other, or behind the place that they are about.
 */
export const translated = (text: string): string => inLines(text, 0) ?? text;

function inLines(text: string, depth: number): string | null {
  if (!text.includes("\n")) return whole(text, depth);
  const lines = text.split("\n").map((line) => ({ line, known: whole(line, depth) }));
  return lines.some(({ known }) => known !== null)
    ? lines.map(({ line, known }) => known ?? line).join("\n")
    : null;
}

function whole(text: string, depth: number): string | null {
  if (depth > DEEPEST) return null;
  const joint = JOINT.exec(text)?.[0] ?? "";
  if (joint) {
    const rest = whole(text.slice(joint.length), depth);
    return rest === null ? null : joint + rest;
  }
  return filled(text, depth) ?? afterPlace(text, depth) ?? inParts(text, depth);
}

/** By the template that fits best. */
function filled(text: string, depth: number): string | null {
  templates ??= SERVER_SENTENCES.map(template).sort(order);
  for (const { core, pattern, names, descriptor } of templates) {
    const values = text.includes(core) ? pattern.exec(text)?.slice(1) : null;
    if (!values) continue;
    const inserted = names.map((name, n) => [name, valueOf(values[n] ?? "", name, depth)]);
    return i18n._(descriptor.id, Object.fromEntries(inserted) as Record<string, string>);
  }
  return null;
}

/** `place: what is wrong`; the place is that of a file or a document, and mostly stays. */
function afterPlace(text: string, depth: number): string | null {
  for (let at = text.indexOf(": "); at >= 0; at = text.indexOf(": ", at + 2)) {
    const rest = whole(text.slice(at + 2), depth + 1);
    if (rest !== null) return `${filled(text.slice(0, at), depth + 1) ?? text.slice(0, at)}: ${rest}`;
  }
  return null;
}

function inParts(text: string, depth: number): string | null {
  for (const between of BETWEEN) {
    const parts = text.split(between);
    if (parts.length === 1) continue;
    const known = parts.map(
      (part) => whole(part, depth + 1) ?? numberOf(part) ?? (DATUM.test(part) ? part : null),
    );
    if (
      known.every((part) => part !== null) &&
      (between === " and " || !parts.every((part) => DATUM.test(part)))
    )
      return known.join(between === " and " ? t` and ` : between);
  }
  return null;
}

/** What a sentence inserts: a number, words of the server, or something that the user has given. */
function valueOf(value: string, name: string, depth: number): string {
  const given = GIVEN.test(name);
  if (given && !value.includes(" ")) return value;
  return (given ? null : numberOf(value)) ?? inLines(value, depth + 1) ?? value;
}

/** A number as the reader writes it, with the digits that it has. */
function numberOf(text: string): string | null {
  if (!NUMBER.test(text)) return null;
  const digits = text.split(".")[1]?.length ?? 0;
  return Number(text.replaceAll(",", "")).toLocaleString(i18n.locale, {
    minimumFractionDigits: digits,
    maximumFractionDigits: digits,
    useGrouping: text.includes(","),
  });
}
