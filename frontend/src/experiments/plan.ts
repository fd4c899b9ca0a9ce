import { plural, t } from "@lingui/core/macro";

import { fixed } from "../language/numbers";
import { localized } from "../language/localized";
import type { SweepCase, SweepCases, SweepWish, VaryWish } from "../api/sweeps";
import type { ScenarioDocument } from "../api/types";
import { shortNumber } from "../editor/parameters";
import { served } from "../language/served";

type Method = SweepWish["method"] & string;

/** What a parameter does in a sweep, as its form has it. */
export interface Varied {
  how: "fixed" | "range" | "set";
  low: number;
  high: number;
  steps: number;
  /** Of a set: numbers between commas. */
  values: string;
}

/** A sweep as its form has it. */
export interface SweepForm {
  varied: Readonly<Record<string, Varied>>;
  /** Values that belong together, as typed: names of parameters, and below them their values row by row. */
  table: string;
  method: Method;
  samples: number;
  sampleSeed: number;
  /** Of the runs; null is the scenario's. */
  seed: number | null;
  /** Minimum TTC of a safe case, seconds; null asks for no collision only. */
  ttc: number | null;
  /** Minimum post-encroachment time, seconds, and most braking needed, m/s². */
  pet: number | null;
  drac: number | null;
  /** Limits of other columns: "mean_speed >= 5". */
  limits: readonly string[];
  figures: readonly string[];
  processes: number;
}

export const METHODS = localized((): readonly { value: Method; label: string }[] => [
  { value: "grid", label: t`Grid: all combinations` },
  { value: "sobol", label: t`Samples: Sobol sequence` },
  { value: "latin", label: t`Samples: Latin hypercube` },
  { value: "random", label: t`Samples: random` },
]);

/** What a form begins with: each parameter with bounds takes five values between them. */
export function newForm({
  parameters,
  formulas,
}: Pick<ScenarioDocument, "parameters" | "formulas">): SweepForm {
  const varied = Object.entries(parameters).map(([name, { value, min, max }]): [string, Varied] => {
    const computed = formulas[`parameters/${name}/value`] !== undefined;
    const bounded = min !== null && max !== null && min < max && !computed;
    return [
      name,
      {
        how: bounded ? "range" : "fixed",
        low: min ?? value,
        high: max ?? value,
        steps: 5,
        values: String(value),
      },
    ];
  });
  return {
    varied: Object.fromEntries(varied),
    table: "",
    method: "grid",
    samples: 32,
    sampleSeed: 0,
    seed: null,
    ttc: 1,
    pet: null,
    drac: null,
    limits: [],
    figures: [],
    processes: 2,
  };
}

/** Numbers of a set, or null if one is none. */
export function setOf(text: string): number[] | null {
  const parts = text.split(/[,;\s]+/).filter(Boolean);
  const found = parts.map(Number);
  return found.length > 0 && found.every(Number.isFinite) ? found : null;
}

/** Values that belong together; `fault` says what is wrong with what was typed. */
export interface Table {
  names: string[];
  rows: number[][];
  fault: string | null;
}

/** Reads a table that was typed or pasted: words between blanks, commas, semicolons or tabs. */
export function tableOf(text: string, parameters: readonly string[]): Table {
  const lines = text.split("\n").map((line) => line.split(/[,;\s]+/).filter(Boolean));
  const [names = [], ...typed] = lines.filter((words) => words.length > 0);
  const rows = typed.map((words) => words.map(Number));
  return { names, rows, fault: text.trim() === "" ? null : faultIn(names, rows, parameters) };
}

function faultIn(names: string[], rows: number[][], parameters: readonly string[]): string | null {
  const strange = names.find((name) => !parameters.includes(name));
  if (strange !== undefined) return t`Table: there is no parameter ${strange} that could be varied.`;
  const twice = names.find((name, n) => names.indexOf(name) < n);
  if (twice !== undefined) return t`Table: ${twice} is there twice.`;
  if (rows.length === 0) return t`Table: write values below the names.`;
  const wrong = rows.findIndex((row) => row.length !== names.length || !row.every(Number.isFinite));
  const [row, count] = [wrong + 1, names.length];
  return wrong < 0
    ? null
    : t`Table: row ${row} needs ${plural(count, { one: "# number", other: "# numbers" })}.`;
}

/** The table of a form, and what its other parameters do: those in the table are varied there. */
function partsOf({ varied, table }: SweepForm): { table: Table; others: [string, Varied][] } {
  const found = tableOf(table, Object.keys(varied));
  const others = Object.entries(varied).filter(
    ([name, { how }]) => how !== "fixed" && !found.names.includes(name),
  );
  return { table: found, others };
}

const LIMIT =
  /^\s*[A-Za-z_]\w*\s*(>=|<=|==|>|<)\s*[+-]?\d+(\.\d+)?([eE][+-]?\d+)?\s*(%|[A-Za-z][A-Za-z/]*)?\s*$/;

/** What is wrong with a form, or null. */
export function faultOf(form: SweepForm): string | null {
  const odd = form.limits.find((one) => !LIMIT.test(one));
  if (odd !== undefined) return t`${odd}: write a column, >=, <=, > or <, and a number.`;
  const { table, others } = partsOf(form);
  if (table.fault !== null) return table.fault;
  if (others.length + table.names.length === 0) return t`Vary at least one parameter.`;
  for (const [name, { how, low, high, values }] of others) {
    if (how === "set" && setOf(values) === null) return t`${name}: write numbers between commas.`;
    if (how === "range" && low >= high) return t`${name}: the range must end above its begin.`;
  }
  return null;
}

/** How many cases a form has. */
export function countOf(form: SweepForm): number {
  if (form.method !== "grid") return form.samples;
  const { table, others } = partsOf(form);
  return others.reduce(
    (product, [, { how, steps, values }]) =>
      product * (how === "range" ? steps : (setOf(values)?.length ?? 0)),
    table.names.length > 0 ? table.rows.length : 1,
  );
}

/** A form as the server takes it. */
export function wishOf(scenario: string, form: SweepForm): SweepWish {
  const grid = form.method === "grid";
  const { table, others } = partsOf(form);
  const single = others.map(([parameter, one]): VaryWish =>
    one.how === "set"
      ? { parameter, values: setOf(one.values) ?? [] }
      : { parameter, low: one.low, high: one.high, ...(grid && { steps: one.steps }) },
  );
  const vary = table.names.length > 0 ? [...single, { parameters: table.names, table: table.rows }] : single;
  return {
    scenario,
    vary,
    method: form.method,
    ...(!grid && { samples: form.samples, sample_seed: form.sampleSeed }),
    safe: limitsOf(form),
    figures: [...form.figures],
    seed: form.seed,
    processes: form.processes,
  };
}

function limitsOf({ ttc, pet, drac, limits }: SweepForm): string[] {
  return [
    ...(ttc === null ? [] : [`min_ttc >= ${ttc}`]),
    ...(pet === null ? [] : [`min_pet >= ${pet}`]),
    ...(drac === null ? [] : [`max_drac <= ${drac}`]),
    ...limits,
  ];
}

/** How a case went, as its dot and its row are coloured. */
export type Verdict = "safe" | "calm" | "unsafe" | "other";
export const VERDICT_WORD = localized((): Record<Verdict, string> => ({
  safe: "safe",
  calm: t`safe, no encounter`,
  unsafe: t`not safe`,
  other: t`not run`,
}));

export function verdictOf({ safe, measures }: SweepCase, columns: SweepCases["columns"]): Verdict {
  if (safe === null) return "other";
  if (!safe) return "unsafe";
  const near = columns.some(
    ({ name }, n) => (name === "min_ttc" || name === "min_pet") && measures[n] !== null,
  );
  return near ? "safe" : "calm";
}

/** A column by which cases can be sorted: their number, whether safe, a parameter or a measure. */
export type Column = { kind: "case" } | { kind: "safe" } | { kind: "value" | "measure"; at: number };

const keyOf = (one: SweepCase, column: Column): number | string | null => {
  if (column.kind === "case") return one.case;
  if (column.kind === "safe") return one.safe === null ? null : Number(one.safe);
  return (column.kind === "value" ? one.values : one.measures)[column.at] ?? null;
};

/** Cases in the order of a column; those that have nothing there come last both ways. */
export function sorted(cases: readonly SweepCase[], column: Column, down: boolean): SweepCase[] {
  const sign = down ? -1 : 1;
  return [...cases].sort((one, other) => {
    const [a, b] = [keyOf(one, column), keyOf(other, column)];
    if (a === null || b === null) return Number(a === null) - Number(b === null);
    return a < b ? -sign : a > b ? sign : one.case < other.case ? -1 : 1;
  });
}

/** Round numbers inside a range, about `parts` of them. */
export function marksOf(low: number, high: number, parts = 6): number[] {
  if (!(high > low)) return [low];
  const rough = (high - low) / parts;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((one) => one >= rough * 0.999) ?? 10 * power;
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) => Number(((first + k) * step).toPrecision(12)));
}

/** Wall time in words. */
export function lasting(seconds: number): string {
  if (seconds < 90) return t`${Math.max(1, Math.round(seconds))} s`;
  if (seconds < 5400) return t`${Math.round(seconds / 60)} min`;
  return t`${fixed(seconds / 3600, 1)} h`;
}

/** Something of cases that has a number, on an axis. */
export interface Axis {
  name: string;
  label: string;
  of: (one: SweepCase) => number | null;
}

/** Parameters, and after them the columns that some case has. */
export function axesOf({ parameters, columns, cases }: SweepCases): Axis[] {
  const label = ({ name, unit }: { name: string; unit: string }): string =>
    unit ? `${name}, ${unit}` : name;
  const found: Axis[] = parameters.map((one, n) => ({
    name: one.name,
    label: label(one),
    of: ({ values }) => values[n] ?? null,
  }));
  const more = columns.map((one, n): Axis => ({
    name: one.name,
    label: label(one),
    of: ({ measures }) => measures[n] ?? null,
  }));
  return [...found, ...more.filter((axis) => cases.some((one) => axis.of(one) !== null))];
}

/** Where values lie, with a little room around, and round numbers between. */
export function scaleOf(
  values: readonly number[],
  from: number,
  to: number,
): [(v: number) => number, number[]] {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const room = (high - low) * 0.05 || Math.abs(low) * 0.05 || 1;
  const [a, b] = [low - room, high + room];
  const at = (v: number): number => Number((from + ((to - from) * (v - a)) / (b - a)).toFixed(2));
  return [at, marksOf(a, b)];
}

/** A case in words: its values and how it went. */
export function titleOf(one: SweepCase, { parameters }: SweepCases, verdict: Verdict): string {
  const values = parameters.map(({ name, unit }, n) =>
    `${name} ${shortNumber(one.values[n] ?? 0)} ${unit}`.trim(),
  );
  const word =
    verdict === "other"
      ? [one.status, served(one.detail ?? "")].filter(Boolean).join(": ")
      : VERDICT_WORD()[verdict];
  return `${one.case}: ${values.join(", ")}: ${word}`;
}

/** What a scenario was before: the one it is a copy of by its name, or else the only other one. */
export function likelyBefore(scenario: string, others: readonly string[]): string | null {
  const originals = others.filter((name) => scenario.startsWith(`${name}-`));
  const longest = originals.sort((one, two) => two.length - one.length)[0];
  return longest ?? (others.length === 1 ? (others[0] ?? null) : null);
}
