import {
  ELIGIBLE,
  FLOW,
  GOAL,
  MEASURE,
  PEDESTRIAN_NODE,
  ROI_BASE,
  ROI_MEMBER,
  TRANSIT,
  VEHICLE_NODE,
} from "../map/colors";
import type { Step } from "./scene";

const ROWS: Partial<Record<Step, [color: string, word: string][]>> = {
  region: [
    [ROI_BASE, "First segment"],
    [ROI_MEMBER, "Region"],
    [ELIGIBLE, "Can be added"],
  ],
  transit: [[TRANSIT, "Stop, begin or end of a line"]],
  measures: [[MEASURE, "Measure"]],
  actors: [
    [VEHICLE_NODE, "Vehicle start"],
    [PEDESTRIAN_NODE, "Pedestrian start"],
    ["#8b949d", "No start possible"],
    [GOAL, "Possible goal"],
    [FLOW, "Vehicle flow"],
  ],
};

export function Legend({ step }: { step: Step }) {
  const rows = ROWS[step];
  if (!rows) return null;
  return (
    <div className="map-legend" aria-hidden="true">
      {rows.map(([color, word]) => (
        <span key={word}>
          <i style={{ background: color }} />
          {word}
        </span>
      ))}
    </div>
  );
}
