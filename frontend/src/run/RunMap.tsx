import { t } from "@lingui/core/macro";
import { type RefObject, useEffect } from "react";

import type { RunInfo } from "../api/runs";
import type { Category } from "../api/types";
import { MapCanvas, type MapHandle, type Pointed } from "../map/MapCanvas";
import type { PackedDrawing } from "../map/drawing";
import type { LoadedGraph } from "../map/loaded";
import type { Mark, MarkKind, Scene } from "../map/scene";
import type { Head } from "../signals/heads";
import type { Crowd } from "./frames";
import { LaneTools } from "./LaneTools";
import { QUANTITIES } from "./laneUse";
import { Legend } from "./Legend";
import { MapTools } from "./MapTools";
import { RunHint } from "./RunHint";
import { ShareMenu } from "./ShareMenu";
import { SpeedChart, type SpeedPoint } from "./SpeedChart";
import type { ShownUse } from "./useLaneUse";
import type { Picture } from "./usePicture";
import type { Player } from "./useReplay";

interface Props {
  run: string;
  info: RunInfo;
  /** Whether the server does not answer at the moment. */
  lost: boolean;
  live: boolean;
  drawing: PackedDrawing;
  loaded: LoadedGraph | null;
  scene: Scene;
  heads: readonly Head[];
  marks: readonly Mark[];
  handle: RefObject<MapHandle | null>;
  picture: Picture;
  player: Player;
  /** Whether there is a recording. */
  replayable: boolean;
  laneUse: ShownUse;
  /** All road users, once they are known. */
  crowd: Crowd | null;
  /** Whether their routes are planned. */
  planned: boolean;
  categories: ReadonlyMap<string, Category>;
  /** Whether states of traffic lights are shown. */
  lights: boolean;
  kinds: ReadonlySet<MarkKind>;
  /** Speeds of the one that is followed. */
  speeds: readonly SpeedPoint[];
  onPick: (at: Pointed) => void;
}

/** A run from above, with what lies on its map. */
export function RunMap({
  run,
  info,
  lost,
  live,
  drawing,
  loaded,
  scene,
  heads,
  marks,
  handle,
  picture,
  player,
  replayable,
  laneUse,
  crowd,
  planned,
  categories,
  lights,
  kinds,
  speeds,
  onPick,
}: Props) {
  const { redraw, now, followed, by } = picture;
  // What has come before the map is drawn with it, so that nothing is missing or flickers.
  useEffect(() => redraw(), [redraw, drawing, loaded]);
  useEffect(() => handle.current?.setHeads(heads), [handle, heads, drawing, loaded]);
  useEffect(() => handle.current?.setMarks(marks), [handle, marks, drawing, loaded]);
  return (
    <MapCanvas
      drawing={drawing}
      graph={loaded?.graph ?? null}
      picker={loaded?.picker ?? null}
      scene={scene}
      handle={handle}
      label={live ? t`Live view of the run` : t`Recording of the run`}
      onPick={onPick}
      onPoint={(at) => {
        if (at && laneUse.by) laneUse.point(at);
      }}
    >
      <RunHint info={info} lost={lost} planned={planned} followed={followed} there={now.there} />
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
        onBy={picture.colourBy}
        share={
          <ShareMenu run={run} handle={handle} playing={live ? null : player.playing} onPlay={player.play} />
        }
      >
        {!live && replayable && <LaneTools shown={laneUse} />}
        {followed && speeds.length > 1 && (
          <SpeedChart
            name={followed}
            points={speeds}
            time={live ? now.time : player.time}
            gap={Math.max(1, 1.5 * (player.replay?.spacing ?? 0))}
          />
        )}
      </MapTools>
    </MapCanvas>
  );
}
