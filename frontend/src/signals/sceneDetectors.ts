import type { LightProgram } from "../api/signals";
import type { SceneDetector } from "../map/scene";

/** The detectors of a light as they are drawn on the map, those filled that are occupied. */
export function sceneDetectors(
  light: LightProgram | null,
  occupied: ReadonlySet<string> = new Set(),
): SceneDetector[] {
  return (light?.detectors ?? []).map(({ id, label, place, bus }) => ({
    place,
    label,
    bus,
    occupied: occupied.has(id),
  }));
}
