import { t } from "@lingui/core/macro";
import { type KeyboardEvent, type PointerEvent, useCallback, useEffect, useRef, useState } from "react";

import type { DayPlan } from "../api/signals";
import { beginOf, dragged, type Grip, LEAST, type Ring, ringOf, sameGrip, secondsOf } from "./ring";

/** Seconds of the bar beyond the cycle, as a share of it: room for a longer green. */
const ROOM = 0.25;
/** Milliseconds after the last key until what was pressed is asked for. */
const PAUSE = 700;

const STEP: Record<string, number> = {
  ArrowRight: 1,
  ArrowUp: 1,
  ArrowLeft: -1,
  ArrowDown: -1,
  PageUp: 5,
  PageDown: -5,
};

interface Draft {
  grip: Grip;
  seconds: number;
}

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
  const [draft, setDraft] = useState<Draft | null>(null);
  const timer = useRef(0);
  const waiting = useRef<Draft | null>(null);
  const held = useRef<{ x: number; from: number; perPixel: number } | null>(null);
  const bar = useRef<HTMLDivElement>(null);
  const ring = ringOf(plan);
  const shown = draft ? dragged(ring, draft.grip, draft.seconds, keepCycle) : ring;
  const span = ring.cycle * (1 + ROOM);
  // The plan with the change has come.
  useEffect(() => {
    if (!waiting.current && !held.current) setDraft(null);
  }, [plan]);

  const commit = useCallback(
    (wish: Draft) => {
      clearTimeout(timer.current);
      waiting.current = null;
      if (wish.seconds === secondsOf(ringOf(plan), wish.grip)) {
        setDraft(null);
        return;
      }
      void onChange(wish.grip, wish.seconds).then((made) => {
        if (!made && !waiting.current) setDraft(null);
      });
    },
    [plan, onChange],
  );
  useEffect(() => () => clearTimeout(timer.current), []);

  const bounded = (grip: Grip, seconds: number): number => {
    const most = grip.is === "offset" ? ring.cycle - 1 : Math.floor(span);
    return Math.min(Math.max(Math.round(seconds), grip.is === "offset" ? 0 : LEAST), most);
  };
  const valueOf = (grip: Grip): number =>
    draft && sameGrip(draft.grip, grip) ? draft.seconds : secondsOf(ring, grip);

  const handlers = (grip: Grip) => ({
    onPointerDown: (event: PointerEvent<HTMLElement>): void => {
      const width = bar.current?.getBoundingClientRect().width ?? 0;
      if (event.button !== 0 || width === 0) return;
      event.preventDefault();
      event.currentTarget.focus();
      event.currentTarget.setPointerCapture(event.pointerId);
      held.current = { x: event.clientX, from: valueOf(grip), perPixel: span / width };
    },
    onPointerMove: (event: PointerEvent<HTMLElement>): void => {
      if (!held.current) return;
      const { x, from, perPixel } = held.current;
      setDraft({ grip, seconds: bounded(grip, from + (event.clientX - x) * perPixel) });
    },
    onPointerUp: (): void => {
      if (!held.current) return;
      held.current = null;
      if (draft) commit(draft);
    },
    onPointerCancel: (): void => {
      held.current = null;
      setDraft(null);
    },
    onKeyDown: (event: KeyboardEvent<HTMLElement>): void => {
      const step = STEP[event.key];
      if (step !== undefined) {
        event.preventDefault();
        const next = { grip, seconds: bounded(grip, valueOf(grip) + step) };
        waiting.current = next;
        setDraft(next);
        clearTimeout(timer.current);
        timer.current = window.setTimeout(() => commit(next), PAUSE);
      } else if (event.key === "Enter" && waiting.current) commit(waiting.current);
      else if (event.key === "Escape" && draft) {
        // The panel stays open.
        event.stopPropagation();
        clearTimeout(timer.current);
        waiting.current = held.current = null;
        setDraft(null);
      }
    },
    onBlur: (): void => {
      if (waiting.current) commit(waiting.current);
    },
  });
  const share = (seconds: number): string => `${((100 * seconds) / span).toFixed(3)}%`;
  const grips = { handlers, value: valueOf, share, ring: shown };
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
          ? t`${gripWords(draft.grip)} ${draft.seconds} s`
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
