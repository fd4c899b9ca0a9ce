import { t } from "@lingui/core/macro";
import { type KeyboardEvent, type PointerEvent, useEffect, useRef, useState } from "react";

import { dayTime } from "../language/units";
import { DAY, spansOf, type Switch } from "./day";

/** Seconds that times are rounded to, and that a key moves them by. */
const STEP = 900;
const HOUR = 3600;
/** Milliseconds after the last key until what was pressed is asked for. */
const PAUSE = 700;

const KEYS: Record<string, number> = {
  ArrowRight: STEP,
  ArrowUp: STEP,
  ArrowLeft: -STEP,
  ArrowDown: -STEP,
  PageUp: HOUR,
  PageDown: -HOUR,
};

interface Draft {
  at: number;
  time: number;
}

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
  const [draft, setDraft] = useState<Draft | null>(null);
  const bar = useRef<HTMLDivElement>(null);
  const held = useRef<{ x: number; from: number; perPixel: number } | null>(null);
  const waiting = useRef<Draft | null>(null);
  const timer = useRef(0);
  useEffect(() => () => clearTimeout(timer.current), []);
  useEffect(() => {
    if (!waiting.current && !held.current) setDraft(null);
  }, [switches]);
  const shown = switches.map((one, n) => (draft?.at === n ? { ...one, time: draft.time } : one));
  const commit = (wish: Draft): void => {
    clearTimeout(timer.current);
    waiting.current = null;
    const from = switches[wish.at];
    if (!from || from.time === wish.time) return setDraft(null);
    void onMove(from, wish.time).then((made) => {
      if (!made && !waiting.current) setDraft(null);
    });
  };
  /** Between the switch before and the one behind: they stay in their order. */
  const bounded = (at: number, time: number): number => {
    const least = at > 0 ? (switches[at - 1]?.time ?? 0) + STEP : 0;
    const most = (switches[at + 1]?.time ?? DAY) - STEP;
    return Math.min(Math.max(Math.round(time / STEP) * STEP, least), Math.max(least, most));
  };
  const share = (time: number): string => `${((100 * time) / DAY).toFixed(3)}%`;
  const onKeyDown = (at: number, event: KeyboardEvent): void => {
    const step = KEYS[event.key];
    if (step !== undefined) {
      event.preventDefault();
      const next = { at, time: bounded(at, (shown[at]?.time ?? 0) + step) };
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
  };
  const onPointerDown = (at: number, event: PointerEvent<HTMLElement>): void => {
    const width = bar.current?.getBoundingClientRect().width ?? 0;
    if (event.button !== 0 || width === 0) return;
    event.preventDefault();
    event.currentTarget.focus();
    event.currentTarget.setPointerCapture(event.pointerId);
    held.current = { x: event.clientX, from: shown[at]?.time ?? 0, perPixel: DAY / width };
  };
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
            onKeyDown={(event) => onKeyDown(n, event)}
            onBlur={() => {
              if (waiting.current) commit(waiting.current);
            }}
            onPointerDown={(event) => onPointerDown(n, event)}
            onPointerMove={(event) => {
              if (!held.current) return;
              const { x, from, perPixel } = held.current;
              setDraft({ at: n, time: bounded(n, from + (event.clientX - x) * perPixel) });
            }}
            onPointerUp={() => {
              if (!held.current) return;
              held.current = null;
              if (draft) commit(draft);
            }}
            onPointerCancel={() => {
              held.current = null;
              setDraft(null);
            }}
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
          ? t`${switches[draft.at]?.plan ?? ""} from ${dayTime(draft.time)}`
          : t`Drag the begin of a plan, or choose one and use the arrow keys.`}
      </p>
    </div>
  );
}
