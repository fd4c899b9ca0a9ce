import { type RefObject, useCallback, useEffect, useMemo, useRef, useState } from "react";

import type { MapHandle } from "../map/MapCanvas";
import type { View } from "../map/view";
import { keep, type Kept } from "../ui/kept";
import type { LaneSight } from "./laneUse";
import type { Camera } from "../scenery/cameras";
import type { ColourBy } from "./tint";
import { added, changed, closed, keptOf, openedViews, type RunSight, type RunViews } from "./views";

export interface ViewsOfRun {
  list: readonly RunSight[];
  /** The view that was used last: the panels beside the maps act on it. */
  used: RunSight;
  /** The map of a view; the same object as long as the view is open. */
  handleOf: (id: number) => RefObject<MapHandle | null>;
  use: (id: number) => void;
  add: (after: number) => void;
  close: (id: number) => void;
  follow: (id: number, user: string | null) => void;
  colour: (id: number, by: ColourBy) => void;
  colourLanes: (id: number, lanes: LaneSight | null) => void;
  /** Looks at it in three dimensions, or as a plan again. */
  look: (id: number, camera: Camera | null) => void;
  /** Takes in what part of the map a view shows. */
  moved: (id: number, at: View) => void;
  /** The view that is to have the focus, as the one that had it was opened or closed; new at each time. */
  focus: { id: number } | null;
}

/** The views of a run as they were in the link, and as they are changed; the address keeps them. */
export function useViews(linked: Kept): ViewsOfRun {
  const [views, setViews] = useState<RunViews>(() => openedViews(linked));
  const [focus, setFocus] = useState<{ id: number } | null>(null);
  const newest = useRef(views);
  newest.current = views;
  const places = useRef(new Map<number, View>());
  const handles = useRef(new Map<number, RefObject<MapHandle | null>>());
  useEffect(() => keep(keptOf(views, places.current)), [views]);
  const handleOf = useCallback((id: number) => {
    const found = handles.current.get(id) ?? { current: null };
    handles.current.set(id, found);
    return found;
  }, []);
  const use = useCallback(
    (id: number) => setViews((old) => (old.used === id ? old : { ...old, used: id })),
    [],
  );
  const refocus = useCallback((next: RunViews) => {
    setViews(next);
    setFocus({ id: next.used });
  }, []);
  const add = useCallback(
    (after: number) => refocus(added(newest.current, after, places.current.get(after) ?? null)),
    [refocus],
  );
  const close = useCallback(
    (id: number) => {
      places.current.delete(id);
      refocus(closed(newest.current, id));
    },
    [refocus],
  );
  const follow = useCallback(
    (id: number, followed: string | null) => setViews((old) => changed(old, id, { followed })),
    [],
  );
  const colour = useCallback((id: number, by: ColourBy) => setViews((old) => changed(old, id, { by })), []);
  const colourLanes = useCallback(
    (id: number, lanes: LaneSight | null) => setViews((old) => changed(old, id, { lanes })),
    [],
  );
  const look = useCallback(
    (id: number, camera: Camera | null) => setViews((old) => changed(old, id, { camera })),
    [],
  );
  const moved = useCallback((id: number, at: View) => {
    // A map that is taken away may still report a frame later.
    if (!newest.current.list.some((one) => one.id === id)) return;
    places.current.set(id, at);
    keep(keptOf(newest.current, places.current));
  }, []);
  const { list } = views;
  const used = list.find(({ id }) => id === views.used) ?? list[0];
  if (!used) throw new Error("a run has no view");
  return useMemo(
    () => ({ list, used, handleOf, use, add, close, follow, colour, colourLanes, look, moved, focus }),
    [list, used, handleOf, use, add, close, follow, colour, colourLanes, look, moved, focus],
  );
}
