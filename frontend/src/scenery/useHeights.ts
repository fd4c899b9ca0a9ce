import { useEffect, useState } from "react";

import { api } from "../api/client";
import type { Assets, HeightColumns, ScenarioDocument } from "../api/types";
import { tellError } from "../ui/notices";

/** Heights of a map, loaded once a view wants them; null until then. */
export function useHeights(wanted: boolean, map: string | null): HeightColumns | null {
  const [heights, setHeights] = useState<HeightColumns | null>(null);
  useEffect(() => {
    if (!wanted || map === null) return;
    let current = true;
    api.heights(map).then((found) => current && setHeights(found), tellError);
    return () => {
      current = false;
    };
  }, [wanted, map]);
  return wanted ? heights : null;
}

/** What the weather of a scenario is, with what was fine-tuned. */
export function weatherValues(
  environment: ScenarioDocument["environment"],
  { weather }: Pick<Assets, "weather">,
): Record<string, number> {
  const preset = weather.find(({ name }) => name === environment.preset);
  return { ...preset?.parameters, ...environment.parameters };
}
