import { nth } from "../lists";
/** Round numbers from 0 to at least `most`, about `parts` of them. */
export function ticks(most: number, parts = 4): number[] {
  const top = most > 0 ? most : 1;
  const rough = top / parts;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((one) => one >= rough * 0.999) ?? 10 * power;
  const last = Math.ceil(top / step - 1e-9);
  return Array.from({ length: last + 1 }, (_, k) => Number((k * step).toPrecision(12)));
}

/** At most `most` of some rows, evenly spread, the last one among them. */
export function thinned<T>(rows: readonly T[], most: number): T[] {
  if (rows.length <= most) return [...rows];
  return Array.from({ length: most }, (_, k) => nth(rows, Math.round((k * (rows.length - 1)) / (most - 1))));
}
