import { useComputedColorScheme } from "@mantine/core";
import { t } from "@lingui/core/macro";
import {
  type KeyboardEvent,
  type PointerEvent,
  type ReactNode,
  type RefObject,
  useCallback,
  useEffect,
  useImperativeHandle,
  useRef,
  useState,
} from "react";

import { localized } from "../language/localized";
import type { Bounds } from "../api/types";
import type { Head } from "../signals/heads";
import { type Area, inBounds, inRing } from "./areas";
import { boundsOf, corners, type Drag, lineOf, type Pixels } from "./drags";
import type { PackedDrawing } from "./drawing";
import type { Graph } from "./graph";
import { MapButtons } from "./MapButtons";
import { useMapLayers } from "./mapLayers";
import { MeasureBar } from "./MeasureBar";
import { Minimap } from "./Minimap";
import type { Picker } from "./picking";
import { CanvasRenderer, type MapRenderer } from "./renderer";
import { ScaleBar } from "./ScaleBar";
import type { Mark, Moving, Scene } from "./scene";
import { useUnderlay, useUnderlays } from "./underlay";
import { useMeasure } from "./useMeasure";
import { hasOwnPointer } from "./ownPointer";
import { clampTo, fit, panBy, type Size, toWorld, type View, visible, zoomAt } from "./view";
import { legendRows } from "./writtenLegend";
import { IN_ADDRESS, type KeptPlace } from "../ui/kept";

/** Where the pointer is, in metres, and how far a touch reaches. */
export interface Pointed {
  x: number;
  y: number;
  reach: number;
  shift: boolean;
}

export interface MapHandle {
  setMoving(moving: Moving | null): void;
  setHeads(heads: readonly Head[]): void;
  setMarks(marks: readonly Mark[]): void;
  show(bounds: Bounds): void;
  /** Brings a place to the middle, or so many pixels to the left of it. */
  centre(x: number, y: number, aside?: number): void;
  /** Brings a place to the middle at the scale that the map has, unless it is in sight already. */
  reveal(x: number, y: number): void;
  view(): View;
  /** The rectangle that is in sight. */
  seen(): Bounds;
  /** What is seen now, in one canvas: the given one, or a new one. */
  picture(into?: HTMLCanvasElement): HTMLCanvasElement | null;
  /** The same as an SVG file, with the legend that lies on the map. */
  vector(): string | null;
  /** Acts on the middle, as Enter does. */
  pickMiddle(): void;
}

interface Props {
  drawing: PackedDrawing;
  /** Name of the map in the catalogue, whose picture lies under it. */
  map?: string;
  graph: Graph | null;
  picker: Picker | null;
  scene: Scene;
  label: string;
  /** Whether a click chooses something, so that the pointer is a cross. */
  aim?: boolean;
  handle?: RefObject<MapHandle | null>;
  /** What lies over the map and shows the same road users and lights, while it is there. */
  over?: RefObject<Pick<MapHandle, "setMoving" | "setHeads" | "picture"> | null>;
  onPick?: (at: Pointed) => void;
  onPoint?: (at: Pointed | null) => void;
  /** Whether the drag that begins here takes something along instead of moving the map. */
  onGrab?: (at: Pointed) => boolean;
  /** What was taken along is put down; null if it was not moved. */
  onDrop?: (at: Pointed | null) => void;
  /** A drag has drawn a rectangle, with Shift held down, or a line around something, with Ctrl. */
  onFrame?: (area: Area) => void;
  /** Where it is kept what part is in sight; stays the same object. */
  place?: KeptPlace;
  children?: ReactNode;
}

const KEYS = localized(
  () =>
    t`Arrow keys move, plus and minus zoom, 0 shows everything, Enter chooses what is in the middle, R measures.`,
);
const CLICK_SLACK = 4;
const TOUCH = 14;
/** Share of the map at each of its edges in which nothing is well in sight. */
const EDGE = 0.06;

/** The map: drag or arrow keys move it, wheel or + and - zoom, Enter acts on the middle. */
export function MapCanvas({
  drawing,
  map,
  graph,
  picker,
  scene,
  label,
  aim = false,
  handle,
  over,
  onPick,
  onPoint,
  onGrab,
  onDrop,
  onFrame,
  place = IN_ADDRESS,
  children,
}: Props) {
  const host = useRef<HTMLDivElement>(null);
  const layers = useRef<HTMLDivElement>(null);
  const renderer = useRef<MapRenderer | null>(null);
  const view = useRef<View>({ x: 0, y: 0, scale: 1 });
  const size = useRef<Size>({ width: 1, height: 1 });
  // Others may move the map before it is placed; that it is, the view does not tell.
  const placed = useRef(false);
  const least = useRef(0.01);
  const drag = useRef<Drag | null>(null);
  // What a drag draws, pixels: two corners of a rectangle, or the points of a line.
  const [drawn, setDrawn] = useState<readonly Pixels[] | null>(null);
  const [shown, setShown] = useState<View>(view.current);
  const [crosshair, setCrosshair] = useState(false);
  const [ready, setReady] = useState<MapRenderer | null>(null);
  const dark = useComputedColorScheme("light") === "dark";
  const queued = useRef(0);
  const shownLayers = useMapLayers();
  const underlay = useUnderlay(map);
  const roads = useUnderlays((all) => all.roads);
  const measure = useMeasure(host);
  const measuring = measure.measured !== null;

  const apply = useCallback(
    (next: View) => {
      view.current = clampTo(next, drawing.bounds);
      renderer.current?.setView(view.current);
      if (!queued.current) {
        queued.current = requestAnimationFrame(() => {
          queued.current = 0;
          setShown(view.current);
          place.write(view.current);
        });
      }
    },
    [drawing, place],
  );

  const showAll = useCallback(() => apply(fit(drawing.bounds, size.current)), [apply, drawing]);

  useEffect(() => {
    if (!layers.current || !host.current) return;
    const made = new CanvasRenderer(layers.current, drawing, graph, picker);
    renderer.current = made;
    const measure = (): void => {
      const box = host.current?.getBoundingClientRect();
      if (!box || box.width < 2) return;
      size.current = { width: box.width, height: box.height };
      made.setSize(size.current, window.devicePixelRatio || 1);
      least.current = fit(drawing.bounds, size.current).scale * 0.6;
      const at = place.read();
      if (placed.current) made.setView(view.current);
      else if (at) apply(at);
      else showAll();
      placed.current = true;
    };
    const observer = new ResizeObserver(measure);
    observer.observe(host.current);
    measure();
    setReady(made);
    if (import.meta.env.MODE !== "production" || location.hash.includes("bench")) {
      Object.assign(window, { odscenRenderer: made, odscenApply: apply });
    }
    return () => {
      observer.disconnect();
      made.destroy();
      renderer.current = null;
    };
  }, [drawing, graph, picker, showAll, apply, place]);

  useEffect(() => ready?.setTheme(dark), [ready, dark]);
  useEffect(() => ready?.setScene(scene), [ready, scene]);
  useEffect(() => ready?.setLayers(shownLayers), [ready, shownLayers]);
  useEffect(
    () => ready?.setUnderlay(shownLayers.picture ? underlay : null, roads),
    [ready, underlay, roads, shownLayers.picture],
  );
  useEffect(() => ready?.setMeasured(measure.marks), [ready, measure.marks]);

  const { add, point, toggle } = measure;
  const onMeasure = useCallback(() => {
    // What would be placed or chosen at the pointer is out of hand now.
    onPoint?.(null);
    toggle();
    host.current?.focus();
  }, [toggle, onPoint]);
  // While the map is measured, clicks belong to that alone.
  const pick = useCallback(
    (at: Pointed) => (measuring ? add([at.x, at.y], TOUCH / view.current.scale) : onPick?.(at)),
    [measuring, add, onPick],
  );
  const pointAt = useCallback(
    (at: Pointed | null) => (measuring ? point(at && [at.x, at.y]) : onPoint?.(at)),
    [measuring, point, onPoint],
  );

  useImperativeHandle(
    handle,
    () => ({
      // What is hidden is not drawn.
      setMoving: (moving) => (over?.current ?? renderer.current)?.setMoving(moving),
      setHeads: (heads) => (over?.current ?? renderer.current)?.setHeads(heads),
      setMarks: (marks) => renderer.current?.setMarks(marks),
      show: (bounds) => apply(fit(bounds, size.current, 0.15)),
      centre: (x, y, aside = 0) => {
        const scale = Math.max(view.current.scale, 8);
        apply({ x: x + aside / scale, y, scale });
      },
      reveal: (x, y) => {
        const [x0, y0, x1, y1] = visible(view.current, size.current);
        const [w, h] = [EDGE * (x1 - x0), EDGE * (y1 - y0)];
        const there = x > x0 + w && x < x1 - w && y > y0 + h && y < y1 - h;
        if (!there) apply({ ...view.current, x, y });
      },
      view: () => view.current,
      picture: (into) => (over?.current ?? renderer.current)?.picture(into) ?? null,
      vector: () => renderer.current?.vector(legendRows(host.current ?? document)) ?? null,
      seen: () => visible(view.current, size.current),
      pickMiddle: () =>
        pick({
          x: view.current.x,
          y: view.current.y,
          reach: Math.max(size.current.width, size.current.height) / 2 / view.current.scale,
          shift: false,
        }),
    }),
    [apply, pick, over],
  );

  // React's wheel listener is passive; the page must not scroll along.
  useEffect(() => {
    const element = host.current;
    if (!element) return;
    const wheel = (event: WheelEvent): void => {
      event.preventDefault();
      const box = element.getBoundingClientRect();
      const step = event.deltaMode === 1 ? event.deltaY * 24 : event.deltaY;
      const factor = Math.exp(-step * (event.ctrlKey ? 0.01 : 0.0016));
      apply(
        zoomAt(
          view.current,
          size.current,
          factor,
          event.clientX - box.left,
          event.clientY - box.top,
          least.current,
        ),
      );
    };
    element.addEventListener("wheel", wheel, { passive: false });
    return () => element.removeEventListener("wheel", wheel);
  }, [apply]);

  const pointed = (sx: number, sy: number, shift: boolean): Pointed => {
    const [x, y] = toWorld(view.current, size.current, sx, sy);
    return { x, y, reach: TOUCH / view.current.scale, shift };
  };
  const local = (event: PointerEvent): [number, number] => {
    const box = host.current?.getBoundingClientRect();
    return [event.clientX - (box?.left ?? 0), event.clientY - (box?.top ?? 0)];
  };
  const zoom = useCallback(
    (factor: number) => {
      const { width, height } = size.current;
      apply(zoomAt(view.current, size.current, factor, width / 2, height / 2, least.current));
    },
    [apply],
  );
  const goTo = useCallback((x: number, y: number) => apply({ ...view.current, x, y }), [apply]);

  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.target !== event.currentTarget || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = event.shiftKey ? 12 : 60;
    const moves: Record<string, [number, number]> = {
      ArrowLeft: [step, 0],
      ArrowRight: [-step, 0],
      ArrowUp: [0, step],
      ArrowDown: [0, -step],
    };
    const middle = (): Pointed => pointed(size.current.width / 2, size.current.height / 2, event.shiftKey);
    const move = moves[event.key];
    if (move) {
      apply(panBy(view.current, ...move));
      pointAt(middle());
    } else if (event.key === "+" || event.key === "=") zoom(1.4);
    else if (event.key === "-") zoom(1 / 1.4);
    else if (event.key === "0" || event.key === "Home") showAll();
    else if (event.key === "Enter" || event.key === " ") pick(middle());
    else if (event.key.toLowerCase() === "r") onMeasure();
    else return;
    setCrosshair(true);
    event.preventDefault();
  };

  return (
    <div
      ref={host}
      className="map"
      data-aim={aim || measuring}
      data-measuring={measuring}
      data-view={`${shown.x} ${shown.y} ${shown.scale}`}
      role="application"
      tabIndex={0}
      aria-label={`${label}. ${KEYS()}`}
      onKeyDown={onKeyDown}
      onBlur={() => setCrosshair(false)}
      onPointerDown={(event) => {
        if (event.button > 1 || hasOwnPointer(event.target)) return;
        setCrosshair(false);
        event.currentTarget.setPointerCapture(event.pointerId);
        const [x, y] = local(event);
        const shift = event.shiftKey;
        const draws =
          onFrame && !measuring && (shift ? "frame" : event.ctrlKey || event.metaKey ? "lasso" : null);
        const does = draws || (!shift && !measuring && onGrab?.(pointed(x, y, false)) ? "carry" : "pan");
        drag.current = { from: [x, y], last: [x, y], moved: false, does, line: [] };
      }}
      onPointerMove={(event) => {
        if (hasOwnPointer(event.target)) return;
        const [x, y] = local(event);
        const held = drag.current;
        if (!held) {
          pointAt(pointed(x, y, event.shiftKey));
          return;
        }
        if (!held.moved && Math.hypot(x - held.from[0], y - held.from[1]) < CLICK_SLACK) return;
        if (held.does === "pan") apply(panBy(view.current, x - held.last[0], y - held.last[1]));
        else if (held.does === "carry") onPoint?.(pointed(x, y, false));
        const line = lineOf(held, [x, y]);
        if (held.does === "frame" || held.does === "lasso") setDrawn(line);
        drag.current = { ...held, last: [x, y], moved: true, line };
      }}
      onPointerUp={(event) => {
        const held = drag.current;
        drag.current = null;
        setDrawn(null);
        if (!held) return;
        const line = lineOf(held, local(event)).map(([x, y]) => toWorld(view.current, size.current, x, y));
        if (held.does === "carry" && (!held.moved || event.button !== 0)) onDrop?.(null);
        if (event.button !== 0) return;
        if (!held.moved) pick(pointed(...held.from, event.shiftKey));
        else if (held.does === "carry") onDrop?.(pointed(...local(event), false));
        else if (held.does === "frame") onFrame?.(inBounds(boundsOf(line)));
        else if (held.does === "lasso") onFrame?.(inRing(line));
      }}
      onPointerCancel={() => {
        if (drag.current?.does === "carry") onDrop?.(null);
        drag.current = null;
        setDrawn(null);
      }}
      onPointerLeave={() => {
        if (!drag.current) pointAt(null);
      }}
    >
      <div ref={layers} className="map-layers" />
      {drawn && (
        <svg className="map-frame" aria-hidden="true">
          <polygon points={(drawn.length === 2 ? corners(boundsOf(drawn)) : drawn).join(" ")} />
        </svg>
      )}
      {crosshair && <div className="map-crosshair" aria-hidden="true" />}
      {/* Controls lie on the map but are not the map. */}
      <div
        className="map-controls"
        onPointerDown={(event) => event.stopPropagation()}
        onPointerMove={(event) => {
          event.stopPropagation();
        }}
      >
        {ready && shownLayers.overview && (
          <Minimap
            renderer={ready}
            bounds={drawing.bounds}
            view={shown}
            size={size.current}
            dark={dark}
            onMove={goTo}
          />
        )}
        <MapButtons
          onZoom={zoom}
          onAll={showAll}
          measuring={measuring}
          onMeasure={onMeasure}
          pictured={underlay !== null}
        />
      </div>
      {measure.measured && <MeasureBar measured={measure.measured} onEnd={measure.end} />}
      <ScaleBar scale={shown.scale} />
      {children}
    </div>
  );
}
