import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { speedText } from "../language/units";
import { nth } from "../lists";
import { clock } from "../ui/words";

const [WIDTH, HEIGHT] = [260, 74];
/** Room for the words of the axes, pixels. */
const [LEFT, BOTTOM, TOP] = [6, 14, 6];
/** The scale reaches at least so high, m/s. */
const LEAST = 30 / 3.6;

export interface SpeedPoint {
  time: number;
  /** m/s. */
  speed: number;
}

/** The line of speeds; it breaks where more than `gap` seconds lie between two. */
export function speedPath(
  points: readonly SpeedPoint[],
  toX: (time: number) => number,
  toY: (speed: number) => number,
  gap: number,
): string {
  return points
    .map(({ time, speed }, k) => {
      const apart = k > 0 && time - nth(points, k - 1).time <= gap;
      return `${apart ? "L" : "M"}${toX(time).toFixed(1)} ${toY(speed).toFixed(1)}`;
    })
    .join("");
}

/** Speed over time of the one that is followed, with the moment that is shown. */
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
  const most = points.reduce((high, { speed }) => Math.max(high, speed), LEAST);
  const toX = (at: number): number => LEFT + ((at - begin) / Math.max(end - begin, 1)) * (WIDTH - 2 * LEFT);
  const toY = (speed: number): number => TOP + (1 - speed / most) * (HEIGHT - TOP - BOTTOM);
  const now = points.findLast((one) => one.time <= time + 1e-6);
  const there = now !== undefined && time - now.time <= gap;
  const words = there ? speedText(now.speed) : t`not on the road`;
  return (
    <figure className="speed-chart">
      <figcaption>
        <Trans>
          Speed of {name}: <b>{words}</b>
        </Trans>
      </figcaption>
      <svg
        viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
        width={WIDTH}
        height={HEIGHT}
        role="img"
        aria-label={t`Speed of ${name} from ${clock(begin)} to ${clock(end)}, at most ${speedText(most)}`}
      >
        <line className="speed-axis" x1={LEFT} x2={WIDTH - LEFT} y1={toY(0)} y2={toY(0)} />
        <line className="speed-axis" x1={LEFT} x2={WIDTH - LEFT} y1={TOP} y2={TOP} />
        <path d={speedPath(points, toX, toY, gap)} />
        {there && <circle cx={toX(time)} cy={toY(now.speed)} r={3.5} />}
        <text x={LEFT + 1} y={TOP + 10}>
          {speedText(most)}
        </text>
        <text x={LEFT} y={HEIGHT - 2}>
          {clock(begin)}
        </text>
        <text x={WIDTH - LEFT} y={HEIGHT - 2} textAnchor="end">
          {clock(end)}
        </text>
      </svg>
    </figure>
  );
}
