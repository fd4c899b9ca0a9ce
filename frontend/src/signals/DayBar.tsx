import { t } from "@lingui/core/macro";

import { dayTime } from "../language/units";
import { DAY, spansOf, type Switch } from "./day";
import { useHandles } from "./useHandles";

/** Seconds that times are rounded to, and that a key moves them by. */
const STEP = 900;
const HOUR = 3600;

const KEYS: Record<string, number> = {
  ArrowRight: STEP,
  ArrowUp: STEP,
  ArrowLeft: -STEP,
  ArrowDown: -STEP,
  PageUp: HOUR,
  PageDown: -HOUR,
};

/** The day as a bar of plans; the times at which they take over are dragged, or moved by keys. */
export function DayBar({
  switches,
  plans,
  onMove,
}: {
  switches: readonly Switch[];
  /** Ids in their order, which gives them their colours. */
  plans: readonly string[];
  /** Asks for another time; false if it was refused. */
  onMove: (from: Switch, time: number) => Promise<boolean>;
}) {
  const { draft, bar, handlers } = useHandles<number>({
    span: DAY,
    keys: KEYS,
    saved: (at) => switches[at]?.time,
    // Between the switch before and the one behind: they stay in their order.
    bounded: (at, time) => {
      const least = at > 0 ? (switches[at - 1]?.time ?? 0) + STEP : 0;
      const most = (switches[at + 1]?.time ?? DAY) - STEP;
      return Math.min(Math.max(Math.round(time / STEP) * STEP, least), Math.max(least, most));
    },
    same: (one, other) => one === other,
    onChange: async (at, time) => {
      const from = switches[at];
      return from !== undefined && (await onMove(from, time));
    },
    source: switches,
  });
  const shown = switches.map((one, n) => (draft?.grip === n ? { ...one, time: draft.value } : one));
  const share = (time: number): string => `${((100 * time) / DAY).toFixed(3)}%`;
  return (
    <div className="day-bar">
      <div className="day-track" ref={bar}>
        {spansOf([...shown].sort((a, b) => a.time - b.time)).map(({ begin, end, plan }) => (
          <div
            key={begin}
            className="day-span"
            data-color={plans.indexOf(plan) % 4}
            style={{ left: share(begin), width: share(end - begin) }}
            title={`${plan}: ${dayTime(begin)} – ${dayTime(end)}`}
            aria-hidden="true"
          >
            {plan}
          </div>
        ))}
        {shown.map(({ time, plan }, n) => (
          <div
            key={n}
            role="slider"
            tabIndex={0}
            className="ring-handle ring-handle-green"
            aria-label={t`Begin of plan ${plan}`}
            aria-valuemin={0}
            aria-valuemax={DAY}
            aria-valuenow={time}
            aria-valuetext={dayTime(time)}
            title={t`${plan} from ${dayTime(time)}`}
            style={{ left: share(time) }}
            {...handlers(n)}
          />
        ))}
      </div>
      <div className="day-hours" aria-hidden="true">
        {[0, 6, 12, 18, 24].map((hour) => (
          <span key={hour} style={{ left: share(hour * HOUR) }}>
            {dayTime((hour % 24) * HOUR)}
          </span>
        ))}
      </div>
      <p className="ring-words" aria-live="polite">
        {draft
          ? t`${switches[draft.grip]?.plan ?? ""} from ${dayTime(draft.value)}`
          : t`Drag the begin of a plan, or choose one and use the arrow keys.`}
      </p>
    </div>
  );
}
