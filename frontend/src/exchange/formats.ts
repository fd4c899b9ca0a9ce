import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";

/** Formats that a scenario can be exported to, besides its document. */
export type Format = "openscenario" | "sumo" | "graphml";

export const FORMATS = localized((): Record<Format, { title: string; words: string }> => ({
  openscenario: {
    title: "OpenSCENARIO",
    words: t`Road users and rules for esmini, ScenarioRunner and others, with the map beside them. SUMO's traffic does not travel.`,
  },
  sumo: {
    title: "SUMO",
    words: t`Network, routes and configuration, which run with plain sumo -c.`,
  },
  graphml: {
    title: "GraphML",
    words: t`The lane graph with the scenario on it, for networkx and other graph tools.`,
  },
}));

export const VERSIONS = localized(() => [
  { value: "1.0", label: t`1.0, as ScenarioRunner reads it` },
  { value: "1.1", label: "1.1" },
  { value: "1.2", label: "1.2" },
  { value: "1.3", label: "1.3" },
]);
