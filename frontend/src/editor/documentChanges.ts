import type { DocumentChange, ScenarioDocument } from "../api/types";

/**
 * A document after changes that the server reports (JSON Patch, RFC 6902). What no change is about
 * stays the same object, so that nothing is computed or drawn anew for it.
 */
export const patched = (document: ScenarioDocument, changes: readonly DocumentChange[]): ScenarioDocument =>
  changes.reduce<unknown>((made, change) => {
    const keys = change.path
      .split("/")
      .slice(1)
      .map((key) => key.replaceAll("~1", "/").replaceAll("~0", "~"));
    return changed(made, keys, change);
  }, document) as ScenarioDocument;

function changed(part: unknown, [key, ...below]: readonly string[], change: DocumentChange): unknown {
  if (key === undefined) return change.value;
  if (Array.isArray(part)) return inList(part, Number(key), below, change);
  if (typeof part !== "object" || part === null) throw new Error(`nothing at ${change.path}`);
  const table = part as Readonly<Record<string, unknown>>;
  if (below.length === 0 && change.op === "remove")
    return Object.fromEntries(Object.entries(table).filter(([name]) => name !== key));
  return { ...table, [key]: changed(table[key], below, change) };
}

function inList(
  list: readonly unknown[],
  row: number,
  below: readonly string[],
  change: DocumentChange,
): unknown[] {
  const last = below.length === 0;
  const beyond = list.length - (last && change.op === "add" ? 0 : 1);
  if (!(row >= 0 && row <= beyond)) throw new Error(`nothing at ${change.path}`);
  if (last && change.op === "add") return list.toSpliced(row, 0, change.value);
  if (last && change.op === "remove") return list.toSpliced(row, 1);
  return list.with(row, changed(list[row], below, change));
}

/**
 * `next` with the objects of `old` wherever they say the same. Parts of lists are known by their
 * `id`, so that all who come after one that is new or gone stay the same objects.
 */
export function reused<T>(old: T, next: T): T {
  if (Object.is(old, next)) return old;
  if (Array.isArray(old) && Array.isArray(next)) return inOldList(old, next) as T;
  if (!isTable(old) || !isTable(next) || Array.isArray(old) || Array.isArray(next)) return next;
  const made = Object.entries(next).map(([key, one]) => [key, reused(old[key], one)] as const);
  const same =
    made.length === Object.keys(old).length && made.every(([key, one]) => key in old && one === old[key]);
  return same ? old : (Object.fromEntries(made) as T);
}

function inOldList(old: readonly unknown[], next: readonly unknown[]): readonly unknown[] {
  let byId: Map<unknown, unknown> | undefined;
  const counterpart = (one: unknown, row: number): unknown => {
    const here = old[row];
    const id = idOf(one);
    if (here === one || id === undefined || idOf(here) === id) return here;
    byId ??= new Map(old.map((each) => [idOf(each), each]));
    return byId.get(id);
  };
  const made = next.map((one, row) => reused(counterpart(one, row), one));
  return made.length === old.length && made.every((one, row) => one === old[row]) ? old : made;
}

const idOf = (value: unknown): unknown => (isTable(value) ? value.id : undefined);

const isTable = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null;
