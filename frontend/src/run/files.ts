import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";
import type { RunFile } from "../api/runs";

const WORD = localized((): Record<string, string> => ({
  "report.html": t`Full report`,
  "parity.html": t`Comparison with CARLA`,
  "summary.json": t`Key figures`,
  "figures.json": t`Figures by road and junction`,
  "actors.json": t`Outcome of each road user`,
  "events.json": t`Incidents`,
  "plan.json": t`Planned trips`,
  "scenario.json": t`The scenario as it was run`,
  "sumo.log": t`Messages of the simulator`,
  "trajectories.parquet": t`Trajectories`,
  "figures/network.csv": t`The whole road network over time`,
  "figures/segments.csv": t`Each road over time`,
  "figures/junctions.csv": t`Each junction over time`,
  "figures/movements.csv": t`Each turning movement over time`,
}));

interface Group {
  title: string;
  text: string;
  files: (RunFile & { word: string })[];
}

const GROUPS = localized((): readonly { title: string; text: string; holds: (name: string) => boolean }[] => [
  {
    title: t`To read`,
    text: t`Open in any browser; they need nothing else.`,
    holds: (name) => name.endsWith(".html"),
  },
  { title: t`Tables`, text: t`Open in a spreadsheet.`, holds: (name) => name.endsWith(".csv") },
  {
    title: t`Figures and lists`,
    text: t`As data, for programs (JSON).`,
    holds: (name) => name.endsWith(".json"),
  },
  {
    title: t`Recordings`,
    text: t`Large tables, for programs (Parquet).`,
    holds: (name) => name.endsWith(".parquet"),
  },
  { title: t`The rest`, text: t`If something went wrong.`, holds: () => true },
]);

/** Files by what one does with them, in plain words where they are known. */
export function fileGroups(files: readonly RunFile[]): Group[] {
  let left = [...files];
  return GROUPS().flatMap(({ title, text, holds }) => {
    const mine = left.filter(({ name }) => holds(name));
    left = left.filter((file) => !mine.includes(file));
    return mine.length > 0
      ? [{ title, text, files: mine.map((file) => ({ ...file, word: WORD()[file.name] ?? file.name })) }]
      : [];
  });
}
