import { type KeyboardEvent, type PointerEvent, type RefObject, useEffect, useRef, useState } from "react";

/** Milliseconds after the last key until what was pressed is asked for. */
const PAUSE = 700;

interface Draft<Grip> {
  grip: Grip;
  value: number;
}

interface Bar<Grip> {
  /** What the whole width of the bar is. */
  span: number;
  /** What keys add. */
  keys: Readonly<Record<string, number>>;
  /** The value that is saved; undefined if there is no such handle any more. */
  saved: (grip: Grip) => number | undefined;
  bounded: (grip: Grip, value: number) => number;
  same: (one: Grip, other: Grip) => boolean;
  /** Asks for another value; false if it was refused. */
  onChange: (grip: Grip, value: number) => Promise<boolean>;
  /** What the values are of: when it changes, that which was asked for has come. */
  source: unknown;
}

interface Handles<Grip> {
  /** What is dragged or typed and not yet saved. */
  draft: Draft<Grip> | null;
  bar: RefObject<HTMLDivElement | null>;
  value: (grip: Grip) => number;
  handlers: (grip: Grip) => object;
}

/** Handles on a bar that are dragged, or moved by keys; Enter or a pause asks for it, Escape takes it back. */
export function useHandles<Grip>(of: Bar<Grip>): Handles<Grip> {
  const [draft, setDraft] = useState<Draft<Grip> | null>(null);
  const timer = useRef(0);
  const waiting = useRef<Draft<Grip> | null>(null);
  const held = useRef<{ x: number; from: number; perPixel: number } | null>(null);
  const bar = useRef<HTMLDivElement>(null);
  useEffect(() => () => clearTimeout(timer.current), []);
  useEffect(() => {
    if (!waiting.current && !held.current) setDraft(null);
  }, [of.source]);
  const now = useRef(of);
  now.current = of;

  const commit = (wish: Draft<Grip>): void => {
    clearTimeout(timer.current);
    waiting.current = null;
    const saved = now.current.saved(wish.grip);
    if (saved === undefined || saved === wish.value) return setDraft(null);
    void now.current.onChange(wish.grip, wish.value).then((made) => {
      if (!made && !waiting.current) setDraft(null);
    });
  };
  const value = (grip: Grip): number =>
    draft && of.same(draft.grip, grip) ? draft.value : (of.saved(grip) ?? 0);

  const handlers = (grip: Grip) => ({
    onPointerDown: (event: PointerEvent<HTMLElement>): void => {
      const width = bar.current?.getBoundingClientRect().width ?? 0;
      if (event.button !== 0 || width === 0) return;
      event.preventDefault();
      event.currentTarget.focus();
      event.currentTarget.setPointerCapture(event.pointerId);
      held.current = { x: event.clientX, from: value(grip), perPixel: of.span / width };
    },
    onPointerMove: (event: PointerEvent<HTMLElement>): void => {
      if (!held.current) return;
      const { x, from, perPixel } = held.current;
      setDraft({ grip, value: of.bounded(grip, from + (event.clientX - x) * perPixel) });
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
      const step = of.keys[event.key];
      if (step !== undefined) {
        event.preventDefault();
        const next = { grip, value: of.bounded(grip, value(grip) + step) };
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
  return { draft, bar, value, handlers };
}
