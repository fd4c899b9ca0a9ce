import { i18n } from "@lingui/core";

/** A number as this reader writes it, with so many digits after the point or comma. */
export const fixed = (n: number, digits: number): string =>
  n.toLocaleString(i18n.locale, {
    minimumFractionDigits: digits,
    maximumFractionDigits: digits,
    useGrouping: false,
  });

/** A number with at most so many digits after the point or comma. */
export const short = (n: number, digits: number): string =>
  n.toLocaleString(i18n.locale, { maximumFractionDigits: digits, useGrouping: false });

/** The number that a field begins with; both a point and a comma part its digits. */
export const parsed = (text: string): number => Number.parseFloat(text.trim().replace(",", "."));

/** What a field shows between the digits of a number in this language. */
export const decimalSign = (): string => fixed(0.5, 1).charAt(1);
