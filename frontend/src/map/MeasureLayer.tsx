import { t } from "@lingui/core/macro";
import { CloseButton } from "@mantine/core";

import { areaText, measuredLength } from "../language/units";
import { area, length, type Measured, type Point, sides } from "./measure";
import { type Size, toScreen, type View } from "./view";

/** Pixels of a side from which its length has room beside it. */
const ROOM = 56;

/** What is measured, drawn on the map with the length of each side, and in words. */
export function MeasureLayer({
  measured,
  pointer,
  view,
  size,
  onEnd,
}: {
  measured: Measured;
  pointer: Point | null;
  view: View;
  size: Size;
  onEnd: () => void;
}) {
  const { points, closed } = measured;
  const at = (point: Point): Point => toScreen(view, size, ...point);
  const shown = points.map(at);
  const last = shown.at(-1);
  const end = pointer && !closed && last ? at(pointer) : null;
  const onward = end && last ? sides({ points: [...points.slice(-1), pointer as Point], closed: false }) : [];
  return (
    <>
      <svg className="map-measure" aria-hidden="true">
        {closed ? <polygon points={shown.join(" ")} /> : <polyline points={shown.join(" ")} />}
        {end && last && <line x1={last[0]} y1={last[1]} x2={end[0]} y2={end[1]} data-open />}
        {shown.map(([x, y], n) => (
          <circle key={n} cx={x} cy={y} r={n === 0 ? 6 : 4.5} />
        ))}
        {[...sides(measured), ...onward].map(({ from, to, metres }, n) => {
          const [[x0, y0], [x1, y1]] = [at(from), at(to)];
          if (Math.hypot(x1 - x0, y1 - y0) < ROOM) return null;
          return (
            <text key={n} x={(x0 + x1) / 2} y={(y0 + y1) / 2}>
              {measuredLength(metres)}
            </text>
          );
        })}
      </svg>
      <div className="map-measured" onPointerDown={(event) => event.stopPropagation()}>
        <span role="status">{said(measured)}</span>
        <CloseButton size="sm" aria-label={t`End measuring`} onClick={onEnd} />
      </div>
    </>
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
