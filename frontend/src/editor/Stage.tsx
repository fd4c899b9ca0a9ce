import { type ReactNode, useRef } from "react";

import type { PackedDrawing } from "../map/drawing";
import { MapCanvas } from "../map/MapCanvas";
import { choose } from "./handlers/select";
import type { Carrier } from "./handlers/handler";
import { Legend } from "./Legend";
import { RoadUserTable } from "./RoadUserTable";
import type { EditorNow } from "./useEditing";
import { useScene } from "./useScene";

/** The map, and below it the table of all road users; choosing in one is choosing in the other. */
export function Stage({
  now,
  drawing,
  children,
}: {
  now: EditorNow;
  drawing: PackedDrawing;
  children: ReactNode;
}) {
  const { graph, picker, document, step, handler, hover, setHover, ones, selection, changes, sights } = now;
  const carried = useRef<Carrier | null>(null);
  const scene = useScene(now);
  const hint = handler.hint(hover);
  return (
    <div className="stage">
      <div className="stage-map">
        <MapCanvas
          drawing={drawing}
          graph={graph}
          picker={picker}
          scene={scene}
          handle={now.handle}
          label={`Map ${document.map.name}`}
          aim={handler.aim}
          onPick={handler.pick}
          onPoint={(at) => setHover(at && (carried.current ?? handler).under(at))}
          onGrab={(at) => {
            carried.current = handler.grab(at);
            return carried.current !== null;
          }}
          onDrop={(at) => {
            carried.current?.drop(at);
            carried.current = null;
            setHover(null);
          }}
          onFrame={handler.frame}
        >
          {hint && (
            <div className="map-hint" role="status">
              {hint}
            </div>
          )}
          <Legend step={step} />
        </MapCanvas>
        {children}
      </div>
      {ones.length > 0 && (step === "actors" || step === "run") && (
        <RoadUserTable
          ones={ones}
          graph={graph}
          selection={selection}
          onRemove={changes.remove}
          onSelectAll={(ids) => {
            now.openActors();
            now.select(ids);
          }}
          onSelect={(id, more) => {
            now.openActors();
            choose(now, id, more);
            const one = ones.find((each) => each.id === id);
            if (one) sights.start(one);
          }}
        />
      )}
    </div>
  );
}
