import { i18n } from "@lingui/core";

const formats = new Map<string, Intl.NumberFormat>();

/** Writes with at least and at most so many digits; to make a format costs a hundred times its use. */
function format(least: number, most: number): Intl.NumberFormat {
  const key = `${i18n.locale} ${least} ${most}`;
  const known = formats.get(key);
  if (known) return known;
  const made = new Intl.NumberFormat(i18n.locale, {
    minimumFractionDigits: least,
    maximumFractionDigits: most,
    useGrouping: false,
  });
  formats.set(key, made);
  return made;
}

/** A number as this reader writes it, with so many digits after the point or comma. */
export const fixed = (n: number, digits: number): string => format(digits, digits).format(n);

/** A number with at most so many digits after the point or comma. */
export const short = (n: number, digits: number): string => format(0, digits).format(n);

/** The number that a field begins with; both a point and a comma part its digits. */
export const parsed = (text: string): number => Number.parseFloat(text.trim().replace(",", "."));

/** What a field shows between the digits of a number in this language. */
export const decimalSign = (): string => fixed(0.5, 1).charAt(1);
