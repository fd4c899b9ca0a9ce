import { t } from "@lingui/core/macro";
import { CloseButton } from "@mantine/core";

import { areaText, measuredLength } from "../language/units";
import { area, length, type Measured } from "./measure";

/** What is measured, in words that a screen reader hears when a point is set or taken back, and a way to end it. */
export function MeasureBar({ measured, onEnd }: { measured: Measured; onEnd: () => void }) {
  return (
    <div className="map-measured" onPointerDown={(event) => event.stopPropagation()}>
      <span role="status">{said(measured)}</span>
      <CloseButton size="sm" aria-label={t`End measuring`} onClick={onEnd} />
    </div>
  );
}

/** What was measured, in words, and what comes next. */
function said(measured: Measured): string {
  const { points, closed } = measured;
  const metres = measuredLength(length(measured));
  if (closed) {
    const ground = areaText(area(measured));
    return t`Area ${ground}, perimeter ${metres}`;
  }
  if (points.length === 0) return t`Measuring: set the first point`;
  if (points.length === 1) return t`Measuring: set the next point`;
  return points.length === 2
    ? t`Length ${metres}`
    : t`Length ${metres}. Set a point on the first one for the area`;
}
