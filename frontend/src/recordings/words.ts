import { t } from "@lingui/core/macro";

import type { Follow, RecordedScene, RecordingInfo, SceneKind } from "../api/recordings";
import { localized } from "../language/localized";
import { lengthOfTime } from "../language/moments";
import { fixed } from "../language/numbers";

/** Kinds of scenes in the order in which they are listed. */
export const KINDS: readonly SceneKind[] = [
  "cut_in",
  "short_ttc",
  "hard_braking",
  "crossing_pedestrian",
  "unprotected_left",
  "lane_change",
];

export const KIND_WORD = localized((): Record<SceneKind, string> => ({
  cut_in: t`Cut-in`,
  short_ttc: t`Short time to collision`,
  hard_braking: t`Hard braking`,
  crossing_pedestrian: t`Crossing pedestrian`,
  unprotected_left: t`Turn across oncoming traffic`,
  lane_change: t`Lane change`,
}));

/** Colours of marks, distinct on light and dark ground. */
export const KIND_COLOR: Record<SceneKind, string> = {
  cut_in: "#7048e8",
  short_ttc: "#e03131",
  hard_braking: "#e8590c",
  crossing_pedestrian: "#1c7ed6",
  unprotected_left: "#2f9e44",
  lane_change: "#868e96",
};

/** The worst value of a scene. */
export function valueText({ kind, value }: RecordedScene): string {
  if (kind === "lane_change") return value > 0 ? t`to the left` : t`to the right`;
  if (kind === "hard_braking") return `${fixed(value, 1)} m/s²`;
  return `${fixed(value, 1)} s`;
}

/** Who is in a scene. */
export function whoText({ id, other }: RecordedScene): string {
  return other === null ? id : t`${id} and ${other}`;
}

/** Seconds of a recording as people read them; those of a clock count from its beginning. */
export function recordedTime({ begin, end }: Pick<RecordingInfo, "begin" | "end">, time: number): string {
  const from = end > 2 * 86_400 ? begin : 0;
  return lengthOfTime(time - from, end - from);
}

export const FOLLOWS = localized((): { value: Follow; label: string; text: string }[] => [
  {
    value: "track",
    label: t`Follow their tracks`,
    text: t`The others are where they were recorded, whatever the ego does.`,
  },
  {
    value: "react",
    label: t`Follow, then react`,
    text: t`The other vehicles follow their tracks until the ego is less than 6 m away or 3 s from a collision; then SUMO drives them. Pedestrians follow their tracks.`,
  },
  {
    value: "drive",
    label: t`Drive themselves`,
    text: t`The other vehicles start where they were recorded, at their recorded speeds, and are driven by SUMO. Pedestrians follow their tracks.`,
  },
]);

/** Who is best taken as ego of a scene: who has to react in it. */
export const egoOf = ({ kind, id, other }: RecordedScene): string =>
  (kind === "cut_in" || kind === "crossing_pedestrian") && other !== null ? other : id;
