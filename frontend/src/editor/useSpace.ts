import { type RefObject, useEffect, useMemo, useRef, useState } from "react";

import { type Assets, CATEGORIES, type HeightColumns } from "../api/types";
import type { Moving, SceneActor } from "../map/scene";
import { type Camera, isCamera } from "../scenery/cameras";
import type { SceneryHandle } from "../scenery/SceneryView";
import { useHeights, weatherValues } from "../scenery/useHeights";
import { keep, parseKept } from "../ui/kept";
import type { EditorNow } from "./useEditing";

/** What the editor shows in three dimensions, and from where. */
export interface Space {
  /** Null for the plan. */
  camera: Camera | null;
  look: (camera: Camera | null) => void;
  /** Null until they are loaded. */
  heights: HeightColumns | null;
  weather: Readonly<Record<string, number>>;
  handle: RefObject<SceneryHandle | null>;
  /** Another number each time that plan and scenery take turns. */
  shows: number;
  changed: () => void;
}

/** Road users where they start, as the moving layer and the scenery draw them. */
export function startsOf(actors: readonly SceneActor[], followed: string | null): Moving {
  const pose = new Float64Array(5 * actors.length);
  actors.forEach(({ x, y, hdg, length, width }, row) => pose.set([x, y, hdg, length, width], 5 * row));
  return {
    count: actors.length,
    pose,
    category: Uint8Array.from(actors, ({ category }) => Math.max(CATEGORIES.indexOf(category), 0)),
    flags: new Uint8Array(actors.length),
    ego: actors.findIndex(({ ego }) => ego),
    followed: actors.findIndex(({ id }) => id === followed),
  };
}

/** Whom a camera goes with: who is selected alone, or else the ego, or the first. */
export const lookedAfter = (actors: readonly SceneActor[], selection: readonly string[]): string | null =>
  (selection.length === 1 ? selection[0] : undefined) ??
  (actors.find(({ ego }) => ego) ?? actors.find(({ category }) => category !== "pedestrian") ?? actors[0])
    ?.id ??
  null;

export function useSpace({ document: { map, environment } }: EditorNow, assets: Assets | null): Space {
  const [camera, look] = useState<Camera | null>(() => {
    const { camera: kept } = parseKept(location.hash);
    return isCamera(kept) ? kept : null;
  });
  useEffect(() => keep({ camera: camera ?? undefined }), [camera]);
  const heights = useHeights(camera !== null, map.name);
  const weather = useMemo(() => (assets ? weatherValues(environment, assets) : {}), [assets, environment]);
  const handle = useRef<SceneryHandle | null>(null);
  const [shows, setShows] = useState(0);
  const there = camera !== null && heights !== null;
  useEffect(() => {
    if (!there) setShows((old) => old + 1);
  }, [there]);
  return {
    camera,
    look,
    heights,
    weather,
    handle,
    shows,
    changed: () => setShows((old) => old + 1),
  };
}
