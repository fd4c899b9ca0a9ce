import { Loader, SegmentedControl } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type ReactNode, useCallback, useEffect, useMemo, useRef, useState } from "react";

import { localized } from "../language/localized";
import type { Assets } from "../api/types";
import type { PackedDrawing } from "../map/drawing";
import { MapCanvas } from "../map/MapCanvas";
import { choose } from "./handlers/select";
import type { Carrier } from "./handlers/handler";
import { Legend } from "./Legend";
import { RoadUserTable } from "./RoadUserTable";
import { TimeDock } from "../time/TimeDock";
import { usePlannedView, withoutStarts } from "../time/usePlannedView";
import { useGhosts } from "../recordings/useGhosts";
import { useSlow } from "../ui/useSlow";
import type { EditorNow } from "./useEditing";
import { useScene } from "./useScene";
import { LookChoice } from "../scenery/LookChoice";
import { OverMap } from "../scenery/OverMap";
import { lookedAfter, startsOf, useSpace } from "./useSpace";

const NO_ROUTE = localized(() => t`No route leads from the start to this point inside the region`);

/** What is below the map. */
type Dock = "table" | "time";

/**
 * The map, and below it, always as high, the table of all road users or the time bar; choosing in one is
 * choosing in the others.
 */
export function Stage({
  now,
  saving,
  drawing,
  assets,
  children,
}: {
  now: EditorNow;
  /** Whether the server is at a change. */
  saving: boolean;
  drawing: PackedDrawing;
  assets: Assets | null;
  children: ReactNode;
}) {
  const { graph, picker, document, step, handler, hover, setHover, ones, selection } = now;
  const [carried, setCarried] = useState<Carrier | null>(null);
  const [dock, setDock] = useState<Dock>("table");
  const [open, setOpen] = useState(true);
  const space = useSpace(now, assets);
  const { camera, heights, shows } = space;
  const watched = lookedAfter(now.actors, selection);
  // On the plan only who is selected is marked.
  const marked = camera !== null ? watched : selection.length === 1 ? (selection[0] ?? null) : null;
  const view = usePlannedView(now, dock === "time" && open, marked, shows);
  const begun = useMemo(() => startsOf(now.actors, watched), [now.actors, watched]);
  const inSpace = camera !== null && heights !== null;
  const { handle } = now;
  useEffect(() => {
    if (!view.shown) handle.current?.setMoving(inSpace ? begun : null);
  }, [handle, view.shown, inSpace, begun, shows]);
  const pick = view.shown ? view.pick : handler.pick;
  const starts = useScene(now);
  const ghosts = useGhosts(now.scenario.name, view.shown ? view.moment : null);
  const scene = useMemo(
    () => ({ ...(view.shown ? withoutStarts(starts) : starts), ghosts }),
    [starts, view.shown, ghosts],
  );
  const hint = view.shown ? view.hint : now.unreachable ? NO_ROUTE() : (carried?.hint ?? handler.hint(hover));
  const head = useMemo(
    () => (
      <SegmentedControl
        size="xs"
        aria-label={t`Below the map`}
        data={[
          { value: "table", label: t`Road users` },
          { value: "time", label: t`Time` },
        ]}
        value={dock}
        onChange={(next) => {
          setDock(next as Dock);
          setOpen(true);
        }}
      />
    ),
    [dock],
  );
  // The table is not made anew as the pointer moves on the map.
  const latest = useRef(now);
  useEffect(() => {
    latest.current = now;
  });
  const remove = useCallback((ids: readonly string[]) => latest.current.changes.remove(ids), []);
  const selectAll = useCallback((ids: string[]) => {
    latest.current.openActors();
    latest.current.select(ids);
  }, []);
  const select = useCallback((id: string, more: boolean) => {
    const { openActors, ones: all, sights } = latest.current;
    openActors();
    choose(latest.current, id, more);
    const one = all.find((each) => each.id === id);
    if (one) sights.start(one);
  }, []);
  const slow = useSlow(saving);
  return (
    <div className="stage">
      <div className="stage-map">
        <MapCanvas
          drawing={drawing}
          map={document.map.name}
          graph={graph}
          picker={picker}
          scene={scene}
          handle={handle}
          over={space.handle}
          label={t`Map ${document.map.name}`}
          aim={handler.aim}
          onPick={pick}
          onPoint={(at) => {
            if (!view.shown) setHover(at && (carried ?? handler).under(at));
          }}
          onGrab={(at) => {
            // Bodies are not where they start now.
            if (view.shown) return false;
            const taken = handler.grab(at);
            setCarried(taken);
            return taken !== null;
          }}
          onDrop={(at) => {
            if (at && carried?.needsRoute && now.unreachable) now.say(NO_ROUTE());
            else if (at) carried?.drop(at);
            setCarried(null);
            setHover(null);
          }}
          onFrame={handler.frame}
        >
          {inSpace && (
            <OverMap
              drawing={drawing}
              graph={graph}
              heights={heights}
              weather={space.weather}
              camera={camera}
              from={() => handle.current?.view() ?? null}
              label={`${t`Map ${document.map.name}`}, 3D`}
              handle={space.handle}
              onPick={pick}
              onFail={() => space.look(null)}
              onReady={space.changed}
            />
          )}
          <div
            className="stage-look"
            onPointerDown={(event) => event.stopPropagation()}
            onPointerMove={(event) => event.stopPropagation()}
            onPointerUp={(event) => event.stopPropagation()}
          >
            <LookChoice camera={camera} onLook={space.look} />
          </div>
          {slow ? (
            <div className="map-hint" role="status">
              <span className="waiting">
                <Trans>
                  <Loader size={16} aria-hidden="true" />
                  Applying the change …
                </Trans>
              </span>
            </div>
          ) : (
            hint && (
              <div className="map-hint" role="status">
                {hint}
              </div>
            )
          )}
          {!inSpace && <Legend step={step} />}
        </MapCanvas>
        {children}
      </div>
      {dock === "time" ? (
        <TimeDock
          now={now}
          plan={view.plan}
          moment={view.moment}
          open={open}
          head={head}
          onMoment={view.setMoment}
          onOpen={setOpen}
        />
      ) : (
        <RoadUserTable
          key={document.demand.clock} // says when all depart
          place={step}
          head={head}
          open={open}
          onOpen={setOpen}
          ones={ones}
          graph={graph}
          selection={selection}
          onRemove={remove}
          onSelectAll={selectAll}
          onSelect={select}
        />
      )}
    </div>
  );
}
