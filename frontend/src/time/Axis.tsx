import { type ReactNode, useRef } from "react";

import { longClock, shortClock } from "../language/moments";
import { type Sight, ticksOf, toTime, toX } from "./sight";

/** Seconds that an arrow key moves the moment, and with Shift. */
const KEY_STEP = 1;
const KEY_STRIDE = 10;

/** The scale of a time bar, and the moment that is shown: a slider over all of it. */
export function Axis({
  sight,
  longest,
  moment,
  label,
  says,
  onMoment,
}: {
  sight: Sight;
  longest: number;
  moment: number;
  /** What the slider is called; null where there is another one for the same. */
  label: string | null;
  /** What it says of a moment besides the time. */
  says?: (time: number) => string;
  /** Nothing where the moment cannot be chosen. */
  onMoment: ((time: number) => void) | null;
}) {
  const host = useRef<HTMLDivElement>(null);
  const put = (clientX: number): void => {
    const box = host.current?.getBoundingClientRect();
    if (!box || !onMoment) return;
    onMoment(Math.min(longest, Math.max(0, toTime(sight, clientX - box.left))));
  };
  const x = toX(sight, moment);
  const there = x >= 0 && x <= sight.width;
  return (
    <div
      className="time-axis"
      ref={host}
      data-still={onMoment === null}
      onPointerDown={(event) => {
        if (!onMoment) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        put(event.clientX);
      }}
      onPointerMove={(event) => {
        if (event.currentTarget.hasPointerCapture(event.pointerId)) put(event.clientX);
      }}
    >
      {ticksOf(sight).map((time) => (
        <span
          key={time}
          className="time-tick"
          data-at={edgeOf(sight, time)}
          style={{ left: toX(sight, time) }}
          aria-hidden="true"
        >
          {shortClock(time, longest)}
        </span>
      ))}
      {onMoment && label === null && there && (
        <div className="time-moment" aria-hidden="true" style={{ left: x }} />
      )}
      {onMoment && label !== null && (
        <div
          className="time-moment"
          role="slider"
          tabIndex={0}
          data-there={there}
          aria-label={label}
          aria-valuemin={0}
          aria-valuemax={longest}
          aria-valuenow={moment}
          aria-valuetext={`${longClock(moment, longest)}${says ? `, ${says(moment)}` : ""}`}
          style={{ left: Math.min(sight.width, Math.max(0, x)) }}
          onKeyDown={(event) => {
            const step = event.shiftKey ? KEY_STRIDE : KEY_STEP;
            const to: Record<string, number> = {
              ArrowRight: moment + step,
              ArrowUp: moment + step,
              ArrowLeft: moment - step,
              ArrowDown: moment - step,
              PageUp: moment + KEY_STRIDE,
              PageDown: moment - KEY_STRIDE,
              Home: 0,
              End: longest,
            };
            const next = to[event.key];
            if (next === undefined) return;
            event.preventDefault();
            onMoment(Math.min(longest, Math.max(0, next)));
          }}
        />
      )}
    </div>
  );
}

/** Words at the very ends are not centred, so that they are not cut off. */
function edgeOf(sight: Sight, time: number): "left" | "right" | "middle" {
  const x = toX(sight, time);
  return x < 24 ? "left" : x > sight.width - 24 ? "right" : "middle";
}

/** Lines through all rows: the scale, and the moment that is shown. */
export function Lines({ sight, moment }: { sight: Sight; moment: number | null }): ReactNode {
  const x = moment === null ? -1 : toX(sight, moment);
  return (
    <div className="time-lines" aria-hidden="true">
      {ticksOf(sight).map((time) => (
        <i key={time} style={{ left: toX(sight, time) }} />
      ))}
      {x >= 0 && x <= sight.width && <b style={{ left: x }} />}
    </div>
  );
}
