import { useMemo } from "react";

import type { MapDetails } from "../api/types";
import type { Graph } from "../map/graph";
import type { Picture } from "../run/usePicture";
import { type Queue, QueueLanes } from "./queues";

/** Who waits before the light of a junction in the newest picture of a run; null if nothing is known. */
export function useQueues({
  map,
  graph,
  junction,
  picture,
}: {
  map: MapDetails | null;
  graph: Graph | null;
  junction: string | null;
  picture: Picture;
}): readonly Queue[] | null {
  const lanes = useMemo(() => {
    const light = junction === null ? undefined : map?.lights.find(({ names }) => names.includes(junction));
    return light && graph ? new QueueLanes(graph, light) : null;
  }, [map, graph, junction]);
  const newest = picture.latest();
  if (!lanes || !newest) return null;
  const { frame, crowd } = newest;
  return lanes.at(frame, (index) => queueing(crowd.named(index)), crowd.origin);
}

/** Metres of a vehicle; people on foot do not queue on the road. */
const queueing = (one: { length: number; category: string } | undefined): number | null =>
  one && one.category !== "pedestrian" ? one.length : null;
