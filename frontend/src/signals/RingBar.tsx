import { t } from "@lingui/core/macro";

import type { DayPlan } from "../api/signals";
import { beginOf, dragged, type Grip, LEAST, type Ring, ringOf, sameGrip, secondsOf } from "./ring";
import { useHandles } from "./useHandles";

/** Seconds of the bar beyond the cycle, as a share of it: room for a longer green. */
const ROOM = 0.25;

const STEP: Record<string, number> = {
  ArrowRight: 1,
  ArrowUp: 1,
  ArrowLeft: -1,
  ArrowDown: -1,
  PageUp: 5,
  PageDown: -5,
};

/** Asks for a change; false if it was refused. */
export type Retime = (grip: Grip, seconds: number) => Promise<boolean>;

interface Props {
  plan: DayPlan;
  /** Whether the next stage gives and takes the seconds of a green. */
  keepCycle: boolean;
  onChange: Retime;
}

/** The cycle as a bar of greens, whose ends, as the cycle and the offset, can be dragged or moved by keys. */
export function RingBar({ plan, keepCycle, onChange }: Props) {
  const ring = ringOf(plan);
  const span = ring.cycle * (1 + ROOM);
  const { draft, bar, value, handlers } = useHandles<Grip>({
    span,
    keys: STEP,
    saved: (grip) => secondsOf(ring, grip),
    bounded: (grip, seconds) => {
      const most = grip.is === "offset" ? ring.cycle - 1 : Math.floor(span);
      return Math.min(Math.max(Math.round(seconds), grip.is === "offset" ? 0 : LEAST), most);
    },
    same: sameGrip,
    onChange,
    source: plan,
  });
  const shown = draft ? dragged(ring, draft.grip, draft.value, keepCycle) : ring;
  const share = (seconds: number): string => `${((100 * seconds) / span).toFixed(3)}%`;
  const grips = { handlers, value, share, ring: shown };
  return (
    <div className="ring" ref={bar}>
      <div className="ring-track">
        {shown.parts.map((part, n) => {
          const begin = beginOf(shown, n);
          return (
            <div key={part.stage} className="ring-part">
              <div
                className="ring-green"
                data-call={part.onCall || undefined}
                style={{ left: share(begin), width: share(part.green) }}
                aria-hidden="true"
              >
                <b>{part.stage}</b>
                <span>{words(part.green)}</span>
              </div>
              <div
                className="ring-between"
                style={{ left: share(begin + part.green), width: share(part.between) }}
                aria-hidden="true"
              />
            </div>
          );
        })}
        {shown.parts.map((part, n) => (
          <Handle
            key={part.stage}
            grip={{ is: "green", stage: part.stage }}
            label={t`Green of stage ${part.stage}`}
            at={beginOf(shown, n) + part.green}
            most={Math.floor(span)}
            {...grips}
          />
        ))}
        <Handle grip={{ is: "cycle" }} label={t`Cycle`} at={shown.cycle} most={Math.floor(span)} {...grips} />
      </div>
      <div className="ring-offset" style={{ width: share(ring.cycle) }} aria-hidden="true" />
      <Handle
        grip={{ is: "offset" }}
        label={t`Offset`}
        at={shown.offset}
        most={Math.max(0, Math.ceil(ring.cycle) - 1)}
        {...grips}
      />
      <p className="ring-words" aria-live="polite">
        {draft
          ? t`${gripWords(draft.grip)} ${draft.value} s`
          : t`Drag an end, or choose one and use the arrow keys.`}
      </p>
    </div>
  );
}

interface HandleProps {
  grip: Grip;
  label: string;
  at: number;
  most: number;
  ring: Ring;
  handlers: (grip: Grip) => object;
  value: (grip: Grip) => number;
  share: (seconds: number) => string;
}

function Handle({ grip, label, at, most, handlers, value, share }: HandleProps) {
  const now = value(grip);
  return (
    <div
      role="slider"
      tabIndex={0}
      className={`ring-handle ring-handle-${grip.is}`}
      aria-label={label}
      aria-valuemin={grip.is === "offset" ? 0 : LEAST}
      aria-valuemax={Math.max(most, Math.ceil(now))}
      aria-valuenow={now}
      aria-valuetext={words(now)}
      title={`${label}: ${words(now)}`}
      style={{ left: share(at) }}
      {...handlers(grip)}
    />
  );
}

const gripWords = (grip: Grip): string =>
  grip.is === "green" ? t`Green of stage ${grip.stage}:` : grip.is === "cycle" ? t`Cycle:` : t`Offset:`;

const words = (seconds: number): string => t`${Math.round(seconds * 10) / 10} s`;
