import { i18n } from "@lingui/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { fromShown, speedText, toShown, unitFor } from "../language/units";
import { nth } from "../lists";
import { clock } from "../language/moments";
import { ticks } from "./scale";

const [WIDTH, HEIGHT] = [220, 82];
/** Room for the words of the axes, pixels. */
const [LEFT, RIGHT, BOTTOM, TOP] = [24, 6, 15, 16];
/** The scale reaches at least so high, m/s. */
const LEAST = 30 / 3.6;

export interface SpeedPoint {
  time: number;
  /** m/s. */
  speed: number;
  /** What is allowed there, m/s, where that is known. */
  limit?: number | null;
}

type Scale = (value: number) => number;

/** The line of speeds; it breaks where more than `gap` seconds lie between two. */
export function speedPath(points: readonly SpeedPoint[], toX: Scale, toY: Scale, gap: number): string {
  return points
    .map(({ time, speed }, k) => {
      const apart = k > 0 && time - nth(points, k - 1).time <= gap;
      return `${apart ? "L" : "M"}${toX(time).toFixed(1)} ${toY(speed).toFixed(1)}`;
    })
    .join("");
}

/** The line of limits, in steps; it breaks where none is known, and as that of speeds does. */
export function limitPath(points: readonly SpeedPoint[], toX: Scale, toY: Scale, gap: number): string {
  let path = "";
  let [before, until] = [null as number | null, -Infinity];
  for (const { time, limit = null } of points) {
    const apart = time - until > gap;
    if (limit !== null) {
      const x = toX(time).toFixed(1);
      const y = toY(limit).toFixed(1);
      if (before === null || apart) path += `M${x} ${y}`;
      else path += before === limit ? `H${x}` : `H${x}V${y}`;
    }
    [before, until] = [limit, time];
  }
  return path;
}

/** Speed over time of the one that is followed, with the limit and the moment that is shown. */
export function SpeedChart({
  name,
  points,
  time,
  gap,
}: {
  name: string;
  points: readonly SpeedPoint[];
  time: number;
  /** Seconds between two points from which on it was not there. */
  gap: number;
}) {
  const [begin, end] = [points[0]?.time ?? 0, points.at(-1)?.time ?? 0];
  const fastest = points.reduce((high, { speed }) => Math.max(high, speed), 0);
  const highest = points.reduce((high, { limit }) => Math.max(high, limit ?? 0), Math.max(fastest, LEAST));
  // Round in the reader's unit.
  const marks = ticks(toShown(highest, "speed"), 3);
  const most = fromShown(marks.at(-1) ?? 1, "speed");
  const toX = (at: number): number =>
    LEFT + ((at - begin) / Math.max(end - begin, 1)) * (WIDTH - LEFT - RIGHT);
  const toY = (speed: number): number => TOP + (1 - speed / most) * (HEIGHT - TOP - BOTTOM);
  const now = points.findLast((one) => one.time <= time + 1e-6);
  const there = now !== undefined && time - now.time <= gap;
  const words = there ? speedText(now.speed) : t`not on the road`;
  const limit = there && now.limit != null ? speedText(now.limit) : null;
  const x = toX(Math.min(Math.max(time, begin), end)).toFixed(1);
  return (
    <figure className="speed-chart">
      <figcaption>
        <Trans>
          Speed of {name}: <b>{words}</b>
        </Trans>
        {limit !== null && (
          <div className="speed-limit">
            <i aria-hidden="true" />
            {t`Limit ${limit}`}
          </div>
        )}
      </figcaption>
      <svg
        viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
        width={WIDTH}
        height={HEIGHT}
        role="img"
        aria-label={t`Speed of ${name} from ${clock(begin)} to ${clock(end)}, at most ${speedText(fastest)}`}
      >
        {marks.map((mark) => {
          const y = toY(fromShown(mark, "speed"));
          return (
            <g key={mark}>
              <line className="speed-axis" x1={LEFT} x2={WIDTH - RIGHT} y1={y} y2={y} />
              <text x={LEFT - 4} y={y + 3.5} textAnchor="end">
                {mark.toLocaleString(i18n.locale)}
              </text>
            </g>
          );
        })}
        <line className="speed-cursor" x1={x} x2={x} y1={TOP} y2={toY(0)} />
        <path className="limit" d={limitPath(points, toX, toY, gap)} />
        <path d={speedPath(points, toX, toY, gap)} />
        {there && <circle cx={x} cy={toY(now.speed)} r={3.5} />}
        <text x={2} y={9}>
          {unitFor("speed").sign}
        </text>
        <text x={LEFT} y={HEIGHT - 2}>
          {clock(begin)}
        </text>
        <text x={WIDTH - RIGHT} y={HEIGHT - 2} textAnchor="end">
          {clock(end)}
        </text>
      </svg>
    </figure>
  );
}
