import {
  ELIGIBLE,
  FLOW,
  GOAL,
  MARK_COLOR,
  MEASURE,
  PEDESTRIAN_NODE,
  ROI_BASE,
  ROI_MEMBER,
  TRANSIT,
  VEHICLE_NODE,
} from "../map/colors";
import type { Step } from "./scene";

/** What is a point on the map has its shape here, too; everything else is a patch of its colour. */
type Shape = "round" | "diamond";

const ROWS: Partial<Record<Step, [color: string, word: string, shape?: Shape][]>> = {
  region: [
    [ROI_BASE, "First segment"],
    [ROI_MEMBER, "Region"],
    [ELIGIBLE, "Can be added"],
  ],
  transit: [[TRANSIT, "Stop, begin or end of a line"]],
  study: [[TRANSIT, "D detector, S section, C cordon"]],
  measures: [[MEASURE, "Measure"]],
  rules: [[MARK_COLOR.rule, "Where rules act"]],
  actors: [
    [VEHICLE_NODE, "Vehicle start", "round"],
    [PEDESTRIAN_NODE, "Pedestrian start", "round"],
    ["#8b949d", "No start possible", "round"],
    [GOAL, "Suggested goal", "diamond"],
    [FLOW, "Vehicle flow"],
  ],
};

export function Legend({ step }: { step: Step }) {
  const rows = ROWS[step];
  if (!rows) return null;
  return (
    <div className="map-legend" aria-hidden="true">
      {rows.map(([color, word, shape]) => (
        <span key={word}>
          <i data-shape={shape} style={{ background: color }} />
          {word}
        </span>
      ))}
    </div>
  );
}
