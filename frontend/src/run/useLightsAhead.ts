import { useMemo } from "react";

import type { MapDetails } from "../api/types";
import type { LoadedGraph } from "../map/loaded";
import type { RunLights } from "../signals/useSignals";
import type { Crowd, Frame } from "./frames";
import { LightsAhead } from "./lightsAhead";
import type { RunSight } from "./views";

/** What lights ahead show is added to frames; null while no view wants to know, or the map has not come. */
export function useLightsAhead(
  views: readonly RunSight[],
  map: MapDetails | null,
  loaded: LoadedGraph | null,
  stateOf: RunLights["stateOf"],
): ((frame: Frame, crowd: Crowd) => Frame) | null {
  // Large maps have many lanes to look at.
  const wanted = views.some(({ by }) => by === "signal");
  const ahead = useMemo(
    () => (wanted && map && loaded ? new LightsAhead(loaded, map.lights) : null),
    [wanted, map, loaded],
  );
  return useMemo(
    () =>
      ahead &&
      ((frame: Frame, crowd: Crowd) => ahead.learn(frame, crowd, (light) => stateOf(light, frame.time))),
    [ahead, stateOf],
  );
}
