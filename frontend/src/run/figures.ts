import { i18n } from "@lingui/core";
import { t } from "@lingui/core/macro";

import { preferences } from "../language/preferences";
import { localized } from "../language/localized";
import { served } from "../language/served";
import { shownAs } from "../language/units";
import { lengthOfTime } from "../language/moments";
import { sentence } from "../ui/words";
import type { FigureInfo } from "../api/figures";
import type { RunState, Summary } from "../api/runs";

export interface Figure {
  name: string;
  label: string;
  /** One sentence on what it is. */
  definition: string;
  value: string;
}

/** A figure of two runs. */
export interface Compared extends Figure {
  before: string;
  difference: string;
  /** Whether the newer run is the better one; null where neither is. */
  better: boolean | null;
}

function get(summary: Summary, { name, part }: FigureInfo): number | null {
  const from: unknown = part ? summary[part] : summary;
  const found = from && typeof from === "object" ? (from as Record<string, unknown>)[name] : undefined;
  return typeof found === "number" ? found : null;
}

function plain(n: number, { unit, factor, digits }: FigureInfo["display"]): string {
  const { suffix, scale } = shownAs(unit ? ` ${unit}` : "");
  const text = (n * factor * scale).toLocaleString(i18n.locale, {
    minimumFractionDigits: digits,
    maximumFractionDigits: digits,
  });
  return text + suffix;
}

/** Less than a minute is said in seconds, as in the report. */
const say = (n: number, { display }: FigureInfo): string =>
  display.clock && n >= 60 ? lengthOfTime(n) : plain(n, display);
const words = ({ name, label, definition }: FigureInfo) => ({
  name,
  label: sentence(served(label)),
  definition: served(definition),
});

/** The key figures of a run; those that the run has not are left out. */
export function keyFigures(summary: Summary, all: readonly FigureInfo[]): Figure[] {
  return all
    .filter((one) => one.on_page)
    .flatMap((one) => {
      const value = get(summary, one);
      return value === null ? [] : [{ ...words(one), value: say(value, one) }];
    });
}

/** Key figures of a run beside those of an earlier one; what neither has is left out. */
export function compared(now: Summary, before: Summary, all: readonly FigureInfo[]): Compared[] {
  return all
    .filter((one) => one.on_page)
    .flatMap((one) => {
      const [a, b] = [get(now, one), get(before, one)];
      if (a === null && b === null) return [];
      const difference = a === null || b === null ? "–" : signed(a - b, one);
      return [
        {
          ...words(one),
          value: a === null ? "–" : say(a, one),
          before: b === null ? "–" : say(b, one),
          difference,
          better:
            a === null || b === null || difference === SAME() || one.better === "neither"
              ? null
              : a > b === (one.better === "higher"),
        },
      ];
    });
}

const SAME = localized(() => t`same`);
function signed(difference: number, { display }: FigureInfo): string {
  const size = plain(Math.abs(difference), display);
  return size === plain(0, display) ? SAME() : `${difference > 0 ? "+" : "−"}${size}`;
}

const ENDED: readonly RunState[] = ["completed", "stopped", "failed", "interrupted"];
export const hasEnded = (state: RunState): boolean => ENDED.includes(state);

export const STATE_WORD = localized((): Record<RunState, string> => ({
  preparing: t`Preparing`,
  running: t`Running`,
  paused: t`Paused`,
  finishing: t`Writing the results`,
  completed: t`Finished`,
  stopped: t`Stopped`,
  failed: t`Failed`,
  interrupted: t`Interrupted`,
}));

export interface Speed {
  value: string;
  label: string;
  speed: number | null;
}

/** Speeds to choose from; null is as fast as the machine can. */
export const SPEEDS = localized((): Speed[] => [
  { value: "0.1", label: "0.1 ×", speed: 0.1 },
  { value: "0.25", label: "0.25 ×", speed: 0.25 },
  { value: "0.5", label: "0.5 ×", speed: 0.5 },
  { value: "1", label: t`Real time`, speed: 1 },
  { value: "2", label: "2 ×", speed: 2 },
  { value: "5", label: "5 ×", speed: 5 },
  { value: "10", label: "10 ×", speed: 10 },
  { value: "max", label: t`As fast as possible`, speed: null },
]);
/** A recording has no limit but the eye. */
export const REPLAY_SPEEDS = localized((): Speed[] => SPEEDS().filter(({ speed }) => speed !== null));

export const when = (seconds1970: number): string =>
  new Date(seconds1970 * 1000).toLocaleString(
    // English dates begin with the day, as the day is what one looks for.
    i18n.locale === "en" ? "en-GB" : i18n.locale,
    { dateStyle: "medium", timeStyle: "short", hour12: preferences().hours === 12 },
  );
