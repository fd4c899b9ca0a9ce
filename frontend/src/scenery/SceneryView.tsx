import { t } from "@lingui/core/macro";
import { type RefObject, useEffect, useImperativeHandle, useRef } from "react";

import type { HeightColumns } from "../api/types";
import type { PackedDrawing } from "../map/drawing";
import type { Graph } from "../map/graph";
import type { Moving } from "../map/scene";
import type { View } from "../map/view";
import type { Head } from "../signals/heads";
import type { Camera } from "./cameras";
import { Heights } from "./heights";
import { steer } from "./keys";
import { Scenery } from "./scenery";

/** What a view in three dimensions takes in, as the plan does. */
export interface SceneryHandle {
  setMoving(moving: Moving | null): void;
  setHeads(heads: readonly Head[]): void;
  picture(into?: HTMLCanvasElement): HTMLCanvasElement | null;
}

interface Props {
  drawing: PackedDrawing;
  graph: Graph;
  heights: HeightColumns;
  weather: Readonly<Record<string, number>>;
  camera: Camera;
  /** What part of the map is in sight first. */
  from: () => View | null;
  label: string;
  handle: RefObject<SceneryHandle | null>;
  onPick: (at: { x: number; y: number; reach: number; shift: boolean }) => void;
  /** The browser cannot draw it. */
  onFail: () => void;
  /** It has been made, and waits for what it is to show. */
  onReady: () => void;
}

const FIRST_TILT = 0.85;
const SLACK = 5;
const REACH = 4;

/** A run in three dimensions: drag moves, the right button turns, the wheel zooms. */
export default function SceneryView({
  drawing,
  graph,
  heights,
  weather,
  camera,
  from,
  label,
  handle,
  onPick,
  onFail,
  onReady,
}: Props) {
  const host = useRef<HTMLDivElement>(null);
  const scenery = useRef<Scenery | null>(null);
  const press = useRef<[number, number] | null>(null);
  const newest = useRef({ from, onFail, onReady });
  newest.current = { from, onFail, onReady };
  useEffect(() => {
    const element = host.current;
    if (!element) return;
    let made: Scenery;
    try {
      made = new Scenery(element, drawing, new Heights(graph.columns, heights), window.devicePixelRatio);
    } catch (error) {
      console.warn(error);
      newest.current.onFail();
      return;
    }
    scenery.current = made;
    // For benchmarks and tests: what was drawn, and how long it took.
    Object.assign(element, { drawn: made.stats });
    const fitted = (): void => {
      const { width, height } = element.getBoundingClientRect();
      made.setSize({ width: Math.max(width, 1), height: Math.max(height, 1) });
    };
    fitted();
    const [x0, y0, x1, y1] = drawing.bounds;
    made.lookAt(newest.current.from() ?? { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale: 1 }, FIRST_TILT);
    const watched = new ResizeObserver(fitted);
    watched.observe(element);
    // The plan below stays as it is.
    const stop = (event: Event): void => event.stopPropagation();
    element.addEventListener("wheel", stop);
    newest.current.onReady();
    return () => {
      watched.disconnect();
      element.removeEventListener("wheel", stop);
      made.destroy();
      scenery.current = null;
    };
  }, [drawing, graph, heights]);
  useEffect(() => scenery.current?.setWeather(weather), [weather, drawing, graph, heights]);
  useEffect(() => scenery.current?.setCamera(camera), [camera, drawing, graph, heights]);
  useImperativeHandle(
    handle,
    () => ({
      setMoving: (moving) => scenery.current?.setMoving(moving),
      setHeads: (heads) => scenery.current?.setHeads(heads),
      picture: (into) => scenery.current?.picture(into) ?? null,
    }),
    [],
  );
  const keys = t`Arrow keys move, plus and minus zoom.`;
  return (
    <div
      ref={host}
      className="scenery"
      role="application"
      tabIndex={0}
      aria-label={`${label}. ${keys}`}
      onPointerDown={(event) => (press.current = [event.clientX, event.clientY])}
      onPointerUp={(event) => {
        const [x, y] = press.current ?? [Infinity, Infinity];
        press.current = null;
        if (Math.hypot(event.clientX - x, event.clientY - y) > SLACK) return;
        const box = event.currentTarget.getBoundingClientRect();
        const at = scenery.current?.placeAt(event.clientX - box.left, event.clientY - box.top);
        if (at) onPick({ ...at, reach: REACH, shift: false });
      }}
      onKeyDown={(event) => {
        if (!scenery.current || !steer(scenery.current, event.key)) return;
        event.preventDefault();
        event.stopPropagation();
      }}
    />
  );
}
