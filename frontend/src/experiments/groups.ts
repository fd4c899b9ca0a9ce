import { i18n } from "@lingui/core";
import { t } from "@lingui/core/macro";

import type { FigureGroup, StudyInfo } from "../api/studies";

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
