import { t } from "@lingui/core/macro";
import { useEffect, useMemo, useRef } from "react";

import type { RunInfo } from "../api/runs";
import type { Bounds, Category } from "../api/types";
import { MapCanvas, type Pointed } from "../map/MapCanvas";
import type { PackedDrawing } from "../map/drawing";
import type { LoadedGraph } from "../map/loaded";
import type { Mark, MarkKind, Scene } from "../map/scene";
import type { Head } from "../signals/heads";
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
import type { Picture } from "./usePicture";
import type { Player } from "./useReplay";
import type { ViewsOfRun } from "./useViews";
import { ViewButtons, viewName } from "./ViewButtons";
import { MOST_VIEWS, type RunSight } from "./views";

interface Props {
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
  const { id, followed, by, begin } = sight;
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
  // What has come before the map is drawn with it, so that nothing is missing or flickers.
  useEffect(() => redraw(), [redraw, drawing, loaded]);
  useEffect(() => handle.current?.setHeads(heads), [handle, heads, drawing, loaded]);
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
              handle={handle}
              playing={live ? null : player.playing}
              onPlay={player.play}
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
