import { useEffect, useState } from "react";

import { api } from "../api/client";
import { runs } from "../api/runs";
import type { HeightColumns } from "../api/types";
import { useHeights, weatherValues } from "../scenery/useHeights";
import { tellError } from "../ui/notices";

/** What a view in three dimensions needs beside what the plan has. */
export interface SceneryParts {
  heights: HeightColumns;
  weather: Readonly<Record<string, number>>;
}

/** Loaded once a view wants it; null until then. */
export function useScenery(
  wanted: boolean,
  map: string | null,
  run: string,
  scenario: string,
): SceneryParts | null {
  const heights = useHeights(wanted, map);
  const [weather, setWeather] = useState<Readonly<Record<string, number>> | null>(null);
  useEffect(() => {
    if (!wanted || map === null) return;
    let current = true;
    weatherOf(run, scenario).then((found) => current && setWeather(found), tellError);
    return () => {
      current = false;
    };
  }, [wanted, map, run, scenario]);
  return heights && weather ? { heights, weather } : null;
}

/** Of the scenario as it was run; of a run that keeps none, as the scenario is now. */
async function weatherOf(run: string, scenario: string): Promise<Record<string, number>> {
  const environment = await runs
    .scenario(run)
    .catch(async () => (await api.scenario(scenario)).document)
    .then((document) => document.environment)
    .catch(() => null);
  if (!environment) return {};
  return weatherValues(environment, await api.assets());
}
