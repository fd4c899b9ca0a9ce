import type { RunFile } from "../api/runs";

const WORD: Record<string, string> = {
  "report.html": "Full report",
  "parity.html": "Comparison with CARLA",
  "summary.json": "Key figures",
  "figures.json": "Figures by road and junction",
  "actors.json": "Outcome of each road user",
  "events.json": "Incidents",
  "plan.json": "Planned trips",
  "scenario.json": "The scenario as it was run",
  "sumo.log": "Messages of the simulator",
  "trajectories.parquet": "Trajectories",
  "figures/network.csv": "The whole road network over time",
  "figures/segments.csv": "Each road over time",
  "figures/junctions.csv": "Each junction over time",
  "figures/movements.csv": "Each turning movement over time",
};

interface Group {
  title: string;
  text: string;
  files: (RunFile & { word: string })[];
}

const GROUPS: readonly { title: string; text: string; holds: (name: string) => boolean }[] = [
  {
    title: "To read",
    text: "Open in any browser; they need nothing else.",
    holds: (name) => name.endsWith(".html"),
  },
  { title: "Tables", text: "Open in a spreadsheet.", holds: (name) => name.endsWith(".csv") },
  {
    title: "Figures and lists",
    text: "As data, for programs (JSON).",
    holds: (name) => name.endsWith(".json"),
  },
  {
    title: "Recordings",
    text: "Large tables, for programs (Parquet).",
    holds: (name) => name.endsWith(".parquet"),
  },
  { title: "The rest", text: "If something went wrong.", holds: () => true },
];

/** Files by what one does with them, in plain words where they are known. */
export function fileGroups(files: readonly RunFile[]): Group[] {
  let left = [...files];
  return GROUPS.flatMap(({ title, text, holds }) => {
    const mine = left.filter(({ name }) => holds(name));
    left = left.filter((file) => !mine.includes(file));
    return mine.length > 0
      ? [{ title, text, files: mine.map((file) => ({ ...file, word: WORD[file.name] ?? file.name })) }]
      : [];
  });
}
