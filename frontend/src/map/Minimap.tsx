import { memo, useEffect, useMemo, useRef } from "react";
import { useLingui } from "@lingui/react";

import type { Bounds } from "../api/types";
import type { MapRenderer } from "./renderer";
import { fit, type Size, toScreen, toWorld, type View, visible } from "./view";

interface Props {
  renderer: MapRenderer;
  bounds: Bounds;
  view: View;
  size: Size;
  dark: boolean;
  onMove: (x: number, y: number) => void;
}

const LONG = 150;

/** The whole map, small, with a frame around what is seen; press or drag to go there. */
export const Minimap = memo(function Minimap({ renderer, bounds, view, size, dark, onMove }: Props) {
  // Drawn anew with another language.
  useLingui();
  const canvas = useRef<HTMLCanvasElement>(null);
  const held = useRef(false);
  const box = useMemo<Size>(() => {
    const aspect = (bounds[2] - bounds[0]) / Math.max(bounds[3] - bounds[1], 1);
    return aspect > 1
      ? { width: LONG, height: Math.max(50, LONG / aspect) }
      : { width: Math.max(50, LONG * aspect), height: LONG };
  }, [bounds]);
  const own = useMemo(() => fit(bounds, box, 0.04), [bounds, box]);

  useEffect(() => {
    if (canvas.current) renderer.drawOverview(canvas.current, own, box, window.devicePixelRatio || 1, dark);
  }, [renderer, own, box, dark]);

  const seen = visible(view, size);
  const [x0, y0] = toScreen(own, box, seen[0], seen[3]);
  const [x1, y1] = toScreen(own, box, seen[2], seen[1]);
  const clamp = (value: number, most: number): number => Math.min(Math.max(value, 0), most);
  const left = clamp(x0, box.width - 4);
  const top = clamp(y0, box.height - 4);
  const go = (event: React.PointerEvent): void => {
    const at = canvas.current?.getBoundingClientRect();
    if (at) onMove(...toWorld(own, box, event.clientX - at.left, event.clientY - at.top));
  };
  return (
    <div
      className="minimap"
      aria-hidden="true"
      style={box}
      onPointerDown={(event) => {
        held.current = true;
        event.currentTarget.setPointerCapture(event.pointerId);
        go(event);
      }}
      onPointerMove={(event) => {
        if (held.current) go(event);
      }}
      onPointerUp={() => {
        held.current = false;
      }}
    >
      <canvas ref={canvas} style={box} />
      <div
        className="minimap-frame"
        style={{
          left,
          top,
          width: Math.max(clamp(x1, box.width) - left, 4),
          height: Math.max(clamp(y1, box.height) - top, 4),
        }}
      />
    </div>
  );
});
