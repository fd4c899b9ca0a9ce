import { lazy, useEffect, useState } from "react";

import { api } from "../api/client";
import { runs } from "../api/runs";
import type { HeightColumns } from "../api/types";
import { tellError } from "../ui/notices";

/** It has a library of its own, and comes when it is wanted. */
export const SceneryView = lazy(() => import("../scenery/SceneryView"));

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
  const [heights, setHeights] = useState<HeightColumns | null>(null);
  const [weather, setWeather] = useState<Readonly<Record<string, number>> | null>(null);
  useEffect(() => {
    if (!wanted || map === null) return;
    let current = true;
    api.heights(map).then((found) => current && setHeights(found), tellError);
    weatherOf(run, scenario).then((found) => current && setWeather(found), tellError);
    return () => {
      current = false;
    };
  }, [wanted, map, run, scenario]);
  return wanted && heights && weather ? { heights, weather } : null;
}

/** Of the scenario as it was run; of a run that keeps none, as the scenario is now. */
async function weatherOf(run: string, scenario: string): Promise<Record<string, number>> {
  const environment = await runs
    .scenario(run)
    .catch(async () => (await api.scenario(scenario)).document)
    .then((document) => document.environment)
    .catch(() => null);
  if (!environment) return {};
  const { weather } = await api.assets();
  const preset = weather.find(({ name }) => name === environment.preset);
  return { ...preset?.parameters, ...environment.parameters };
}
