import { t } from "@lingui/core/macro";
import { useEffect, useMemo, useRef, useState } from "react";

import type { RunInfo } from "../api/runs";
import type { Bounds, Category } from "../api/types";
import { MapCanvas, type Pointed } from "../map/MapCanvas";
import type { PackedDrawing } from "../map/drawing";
import type { LoadedGraph } from "../map/loaded";
import type { Mark, MarkKind, Scene } from "../map/scene";
import type { Head } from "../signals/heads";
import { LookChoice } from "../scenery/LookChoice";
import { OverMap } from "../scenery/OverMap";
import type { SceneryHandle } from "../scenery/SceneryView";
import type { KeptPlace } from "../ui/kept";
import type { Crowd } from "./frames";
import { LaneTools } from "./LaneTools";
import { QUANTITIES } from "./laneUse";
import { Legend } from "./Legend";
import type { LimitOf } from "./limits";
import { MapTools } from "./MapTools";
import { RunHint } from "./RunHint";
import { ShareMenu } from "./ShareMenu";
import { SpeedChart } from "./SpeedChart";
import { type LaneData, useLaneUse } from "./useLaneUse";
import { useScenery } from "./useScenery";
import type { Picture } from "./usePicture";
import type { Player } from "./useReplay";
import type { ViewsOfRun } from "./useViews";
import { ViewButtons, viewName } from "./ViewButtons";
import { MOST_VIEWS, type RunSight } from "./views";

interface Props {
  scenario: string;
  run: string;
  /** Null in all views but the first, which alone says how the preparation goes. */
  info: RunInfo | null;
  /** Whether the server does not answer at the moment. */
  lost: boolean;
  live: boolean;
  /** Name of the map in the catalogue. */
  map: string | undefined;
  drawing: PackedDrawing;
  loaded: LoadedGraph | null;
  scene: Scene;
  heads: readonly Head[];
  marks: readonly Mark[];
  /** Where the scenario takes place. */
  bounds: Bounds | null;
  /** This view, and all of them. */
  sight: RunSight;
  views: ViewsOfRun;
  picture: Picture;
  player: Player;
  /** Whether there is a recording. */
  replayable: boolean;
  lanes: LaneData;
  limitOf: LimitOf | null;
  /** All road users, once they are known. */
  crowd: Crowd | null;
  /** Whether their routes are planned. */
  planned: boolean;
  categories: ReadonlyMap<string, Category>;
  /** Whether states of traffic lights are shown. */
  lights: boolean;
  kinds: ReadonlySet<MarkKind>;
  /** Something on the map is chosen in this view. */
  onPick: (at: Pointed) => void;
}

/** One view of a run from above, with what lies on its map. */
export function RunMap({
  scenario,
  run,
  info,
  lost,
  live,
  drawing,
  map,
  loaded,
  scene,
  heads,
  marks,
  bounds,
  sight,
  views,
  picture,
  player,
  replayable,
  lanes,
  limitOf,
  crowd,
  planned,
  categories,
  lights,
  kinds,
  onPick,
}: Props) {
  const { id, followed, by, begin, camera } = sight;
  const { list, handleOf, moved, focus } = views;
  const { redraw, now } = picture;
  const { replay } = player;
  const handle = handleOf(id);
  const frame = useRef<HTMLDivElement>(null);
  const measured = !live && replayable;
  const laneUse = useLaneUse(lanes, loaded, measured ? sight.lanes : null, (next) =>
    views.colourLanes(id, next),
  );
  const name = list.length > 1 ? viewName(list.findIndex((one) => one.id === id) + 1, list.length) : null;
  const what = live ? t`Live view of the run` : t`Recording of the run`;
  const place = useMemo<KeptPlace>(
    () => ({ read: () => begin ?? undefined, write: (at) => moved(id, at) }),
    [id, begin, moved],
  );
  const brought = useRef(false);
  useEffect(() => {
    if (!bounds || begin || brought.current) return;
    brought.current = true;
    handle.current?.show(bounds);
  }, [handle, bounds, begin]);
  useEffect(() => {
    if (focus?.id === id) frame.current?.querySelector<HTMLElement>('[role="application"]')?.focus();
  }, [focus, id]);
  const coloured = useMemo(() => ({ ...scene, laneColors: laneUse.colors }), [scene, laneUse.colors]);
  // No limit of a lane is meant for people on foot.
  const limits = followed !== null && categories.get(followed) !== "pedestrian" ? limitOf : null;
  const recorded = useMemo(
    () => (replay && followed ? replay.speedsOf(followed, limits) : null),
    [replay, followed, limits],
  );
  const speeds = recorded ?? (followed ? picture.speedsOf(followed) : []);
  const scenery = useRef<SceneryHandle | null>(null);
  const parts = useScenery(camera !== null, map ?? null, run, scenario);
  // Anew each time that it is there, or gone.
  const [shows, setShows] = useState(0);
  const inSpace = camera !== null && parts !== null && loaded !== null;
  useEffect(() => {
    if (!inSpace) setShows((old) => old + 1);
  }, [inSpace]);
  // What has come before the map is drawn with it, so that nothing is missing or flickers.
  useEffect(() => redraw(), [redraw, drawing, loaded, shows]);
  useEffect(() => handle.current?.setHeads(heads), [handle, heads, drawing, loaded, shows]);
  useEffect(() => handle.current?.setMarks(marks), [handle, marks, drawing, loaded]);
  const use = (): void => views.use(id);
  return (
    <div
      ref={frame}
      className="run-view"
      {...(name !== null && { role: "group", "aria-label": name, "aria-current": id === views.used.id })}
      onPointerDownCapture={use}
      onWheelCapture={use}
      onFocusCapture={use}
    >
      <MapCanvas
        drawing={drawing}
        map={map}
        graph={loaded?.graph ?? null}
        picker={loaded?.picker ?? null}
        scene={coloured}
        handle={handle}
        over={scenery}
        label={name === null ? what : `${what}, ${name}`}
        place={place}
        onPick={(at) => {
          laneUse.point(at);
          onPick(at);
        }}
        onPoint={(at) => {
          if (at && laneUse.by) laneUse.point(at);
        }}
      >
        {inSpace && (
          <OverMap
            drawing={drawing}
            graph={loaded.graph}
            heights={parts.heights}
            weather={parts.weather}
            camera={camera}
            from={() => handle.current?.view() ?? null}
            label={`${name === null ? what : `${what}, ${name}`}, 3D`}
            handle={scenery}
            onPick={onPick}
            onFail={() => views.look(id, null)}
            onReady={() => setShows((old) => old + 1)}
          />
        )}
        <RunHint
          info={info}
          lost={lost}
          planned={planned}
          followed={followed}
          there={followed !== null && now.there.has(followed)}
        />
        <Legend
          categories={new Set(categories.values())}
          ego={(crowd?.egos().length ?? 0) > 0}
          lights={lights}
          lamps={live}
          marks={kinds}
          by={by}
          lanes={laneUse.by && laneUse.legend && { ...laneUse.legend, word: QUANTITIES()[laneUse.by].word }}
        />
        <MapTools
          by={by}
          live={live}
          lights={lights}
          onBy={(next) => views.colour(id, next)}
          share={
            <ShareMenu
              run={run}
              handle={inSpace ? scenery : handle}
              vector={inSpace ? null : () => handle.current?.vector() ?? null}
              playing={live ? null : player.playing}
              onPlay={player.play}
            />
          }
          look={
            <LookChoice
              camera={camera}
              onLook={(next) => {
                // Who is looked after is the ego, unless another one is.
                const [ego] = crowd?.egos() ?? [];
                const one = ego ?? crowd?.all().find(({ category }) => category === "car")?.id;
                if (next && next !== "above" && followed === null && one) views.follow(id, one);
                views.look(id, next);
              }}
            />
          }
          views={
            <ViewButtons
              name={name}
              onAdd={list.length < MOST_VIEWS ? () => views.add(id) : null}
              onClose={() => views.close(id)}
            />
          }
        >
          {measured && <LaneTools shown={laneUse} />}
          {followed && speeds.length > 1 && (
            <SpeedChart
              name={followed}
              points={speeds}
              time={live ? now.time : player.time}
              gap={Math.max(1, 1.5 * (replay?.spacing ?? 0))}
            />
          )}
        </MapTools>
      </MapCanvas>
    </div>
  );
}
