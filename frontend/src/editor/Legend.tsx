import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";
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
  UNUSABLE,
  VEHICLE_NODE,
} from "../map/colors";
import type { Step } from "./scene";

/** What is a point on the map has its shape here, too; everything else is a patch of its colour. */
type Shape = "round" | "diamond";

const ROWS = localized((): Partial<Record<Step, [color: string, word: string, shape?: Shape][]>> => ({
  region: [
    [ROI_BASE, t`First segment`],
    [ROI_MEMBER, t`Region`],
    [ELIGIBLE, t`Can be added`],
  ],
  transit: [[TRANSIT, t`Stop, begin or end of a line`]],
  study: [[TRANSIT, t`D detector, S section, C cordon`]],
  lights: [[TRANSIT, t`Traffic light`]],
  measures: [[MEASURE, t`Measure`]],
  rules: [[MARK_COLOR.rule, t`Where rules act`]],
  actors: [
    [VEHICLE_NODE, t`Vehicle start`, "round"],
    [PEDESTRIAN_NODE, t`Pedestrian start`, "round"],
    [UNUSABLE, t`No start possible`, "round"],
    [GOAL, t`Suggested goal`, "diamond"],
    [FLOW, t`Vehicle flow`],
  ],
}));

export function Legend({ step }: { step: Step }) {
  const rows = ROWS()[step];
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
