import { i18n } from "@lingui/core";
import { t } from "@lingui/core/macro";

import { served } from "../language/served";
import { shownUnit } from "../language/units";
import type { FigureGroup, StudyFigure, StudyInfo, StudyResults } from "../api/studies";
import { sentence } from "../ui/words";

/** What the command line and the files call a scenario without edits. */
const AS_DESIGNED = "as-designed";

export const variantWord = (variant: string): string => (variant === AS_DESIGNED ? t`as designed` : variant);

/** `12.4 ± 0.3`, or the one value, or a dash. */
export function meanWord({ mean, half_width: half, values }: FigureGroup): string {
  if (mean === null || half === null) return values[0] === undefined ? "–" : rounded(values[0]);
  return `${rounded(mean, half)} ± ${rounded(half, half)}`;
}

/** Whether a difference is more than chance. */
export const matters = ({ mean, half_width: half }: FigureGroup): boolean =>
  mean !== null && half !== null && Math.abs(mean) > half;

/** As many digits as `by` has two of. */
export function rounded(value: number, by = value): string {
  const size = Math.abs(by) || Math.abs(value) || 1;
  const digits = Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(size))));
  const text = value.toLocaleString(i18n.locale, {
    minimumFractionDigits: digits,
    maximumFractionDigits: digits,
  });
  return text.replace("-", "−");
}

/** How far a study is, in a few words. */
export function outcomeWord({ state, runs, ended, completed }: StudyInfo): string {
  const far = t`${ended.toLocaleString(i18n.locale)} of ${runs.toLocaleString(i18n.locale)} runs`;
  if (state !== "done") return `${state}, ${far}`;
  return completed === runs
    ? t`all runs completed`
    : t`${(runs - completed).toLocaleString(i18n.locale)} of ${runs.toLocaleString(i18n.locale)} runs failed`;
}

/** Results in the units of the reader. */
export function inReadersUnits(results: StudyResults): StudyResults {
  const unit = results.figures.find(({ name }) => name === results.figure)?.unit ?? "";
  const { shown } = shownUnit(unit);
  const maybe = (value: number | null): number | null => (value === null ? null : shown(value));
  const group = (one: FigureGroup): FigureGroup => ({
    ...one,
    mean: maybe(one.mean),
    half_width: maybe(one.half_width),
    values: one.values.map(shown),
  });
  return {
    ...results,
    figures: results.figures.map((one) => ({ ...one, unit: shownUnit(one.unit).sign })),
    groups: results.groups.map(group),
    differences: results.differences.map(group),
    between: results.between.map(group),
  };
}

/** What a difference from the first scenario means, in one sentence. */
export function differenceWords(figure: StudyFigure, one: FigureGroup, first: string): string {
  const label = sentence(served(figure.label));
  const unit = figure.unit ? ` ${figure.unit}` : "";
  const { mean, half_width: half, scenario } = one;
  if (mean === null || half === null)
    return t`${label}: two runs of each are needed to compare ${scenario} with ${first}.`;
  const [low, high] = [mean - half, mean + half];
  if (!matters(one))
    return t`${label}: no clear difference between ${scenario} and ${first} (${rounded(low, half)} to ${rounded(high, half)}${unit}).`;
  const [least, most] = mean > 0 ? [low, high] : [-high, -low];
  const by = `${rounded(Math.abs(mean), half)}${unit} (${rounded(least, half)} to ${rounded(most, half)})`;
  const change =
    mean > 0
      ? t`${label} rises by ${by} in ${scenario}, compared with ${first}`
      : t`${label} falls by ${by} in ${scenario}, compared with ${first}`;
  if (figure.better === "neither") return `${change}.`;
  return mean > 0 === (figure.better === "higher") ? t`${change}: better.` : t`${change}: worse.`;
}
