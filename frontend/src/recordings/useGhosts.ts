import { useCallback, useMemo } from "react";

import { type Ghost, recordings } from "../api/recordings";
import { nth } from "../lists";
import type { SceneGhost } from "../map/scene";
import { momentAt } from "../run/replay";
import { useLoaded } from "../ui/useLoaded";

/** Tracks of the recording that a scenario was made of, and where they are at a moment, s of the run. */
export function useGhosts(scenario: string, moment: number | null): readonly SceneGhost[] {
  const { value } = useLoaded(useCallback(() => recordings.ghosts(scenario), [scenario]));
  const lines = useMemo(
    () => value?.map(({ x, y }) => x.map((each, k): readonly [number, number] => [each, nth(y, k)])) ?? [],
    [value],
  );
  return useMemo(
    () =>
      (value ?? []).map((ghost, n) => ({
        points: nth(lines, n),
        body: moment === null ? null : bodyAt(ghost, moment),
      })),
    [value, lines, moment],
  );
}

/** Where a track is at a time; between two places evenly. */
export function bodyAt(ghost: Ghost, moment: number): SceneGhost["body"] {
  const { time, x, y, hdg, length, width } = ghost;
  const last = time.length - 1;
  if (last < 0 || moment < nth(time, 0) || moment > nth(time, last)) return null;
  const k = momentAt(time, moment);
  const next = Math.min(k + 1, last);
  const span = nth(time, next) - nth(time, k);
  const share = span > 0 ? (moment - nth(time, k)) / span : 0;
  const turn = Math.atan2(Math.sin(nth(hdg, next) - nth(hdg, k)), Math.cos(nth(hdg, next) - nth(hdg, k)));
  return {
    x: nth(x, k) + share * (nth(x, next) - nth(x, k)),
    y: nth(y, k) + share * (nth(y, next) - nth(y, k)),
    hdg: nth(hdg, k) + share * turn,
    length,
    width,
  };
}
