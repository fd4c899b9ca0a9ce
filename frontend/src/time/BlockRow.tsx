import { t } from "@lingui/core/macro";
import { type KeyboardEvent, type PointerEvent, useRef } from "react";

import { CATEGORY_COLOR, FLOW, MARK_COLOR, MEASURE } from "../map/colors";
import { type Sight, snapped, snapStep, toX } from "./sight";
import { type Block, type Grip, wordsOf } from "./blocks";
import type { Retiming } from "./useRetiming";

/** Pixels of what has no length. */
const LEAST = 16;
/** Pixels of the words beside a block, about. */
const WORDS = 230;
/** Seconds that an arrow key moves a block: usually, with Shift, with Alt. */
const STEP = { usual: 1, wide: 10, fine: 0.1 } as const;

/** One row of the time bar: a block that can be dragged, its ends where it has some, and when it is. */
export function BlockRow({
  block,
  sight,
  longest,
  retiming,
  onChoose,
}: {
  block: Block;
  sight: Sight;
  longest: number;
  retiming: Retiming;
  onChoose: () => void;
}) {
  const from = useRef<{ grip: Grip; x: number; moved: boolean } | null>(null);
  const times = retiming.timesOf(block);
  // What is planned moves along with the departure.
  const until = block.ends ? (times.end ?? block.until) : block.until + times.begin - block.begin;
  // An instant is in the middle of its mark.
  const left = toX(sight, times.begin) - (block.kind === "rule" ? LEAST / 2 : 0);
  const right = Math.max(toX(sight, until), left + LEAST);
  const words = wordsOf(block, times, until);
  const grips: Grip[] = block.ends ? ["all", "begin", "end"] : ["all"];

  const onPointerDown = (event: PointerEvent<HTMLElement>, grip: Grip): void => {
    if (event.button !== 0) return;
    event.currentTarget.setPointerCapture(event.pointerId);
    event.currentTarget.focus();
    from.current = { grip, x: event.clientX, moved: false };
  };
  const onPointerMove = (event: PointerEvent): void => {
    const drag = from.current;
    if (!drag) return;
    const pixels = event.clientX - drag.x;
    if (!drag.moved && Math.abs(pixels) < 3) return;
    drag.moved = true;
    const held = drag.grip === "end" ? (block.end ?? longest) : block.begin;
    const to = snapped(held + (pixels / sight.width) * sight.seconds, snapStep(sight));
    retiming.hold(block, drag.grip, to - held);
  };
  const onPointerUp = (): void => {
    const drag = from.current;
    from.current = null;
    if (drag?.moved) retiming.drop();
    else if (drag) onChoose();
  };
  const onKeyDown = (event: KeyboardEvent, grip: Grip): void => {
    const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (sign !== undefined && !event.ctrlKey && !event.metaKey) {
      const step = event.altKey ? STEP.fine : event.shiftKey ? STEP.wide : STEP.usual;
      retiming.nudge(block, grip, sign * step);
    } else if (event.key === "Enter" || event.key === " ") onChoose();
    else if (event.key === "Escape" && from.current) {
      from.current = null;
      retiming.putBack();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <div className="time-track">
      {grips.map((grip) => {
        const now = grip === "end" ? (times.end ?? longest) : times.begin;
        return (
          <div
            key={grip}
            className="time-block"
            role="slider"
            tabIndex={0}
            data-kind={block.kind}
            data-grip={grip}
            aria-label={nameOf(block, grip)}
            aria-valuemin={0}
            aria-valuemax={Math.max(longest, now)}
            aria-valuenow={now}
            aria-valuetext={words}
            style={
              grip === "all"
                ? { left, width: right - left, background: colorOf(block) }
                : { left: (grip === "begin" ? left : right) - 4, width: 8 }
            }
            onPointerDown={(event) => onPointerDown(event, grip)}
            onPointerMove={onPointerMove}
            onPointerUp={onPointerUp}
            onPointerCancel={() => {
              from.current = null;
              retiming.putBack();
            }}
            onKeyDown={(event) => onKeyDown(event, grip)}
          />
        );
      })}
      <span className="time-words" aria-hidden="true" style={placeOfWords(left, right, sight.width)}>
        {words}
      </span>
    </div>
  );
}

/** Right of the block, or where there is no room left of it, or inside. */
function placeOfWords(left: number, right: number, width: number): { left: number } | { right: number } {
  if (width - right >= WORDS || left < WORDS)
    return width - right >= WORDS ? { left: Math.max(right, 0) + 6 } : { right: 6 };
  return { right: width - Math.min(left, width) + 6 };
}

function nameOf({ kind, id }: Block, grip: Grip): string {
  if (kind === "actor") return t`Departure of ${id}`;
  if (kind === "rule") return t`Time of rule ${id}`;
  const what = kind === "flow" ? t`flow ${id}` : `measure ${id}`;
  return grip === "all" ? t`Time of ${what}` : grip === "begin" ? t`Begin of ${what}` : t`End of ${what}`;
}

export function colorOf({ kind, category }: Block): string {
  if (category) return CATEGORY_COLOR[category];
  return kind === "rule" ? MARK_COLOR.rule : kind === "measure" ? MEASURE : FLOW;
}
