import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import "../run/run.css";
import "./recordings.css";

import { Alert, Button, Group, Loader, Select, Text, Title } from "@mantine/core";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import { recordings, type RecordedScene, type RecordingInfo, type SceneKind } from "../api/recordings";
import type { Bounds } from "../api/types";
import { countFrom } from "../language/moments";
import type { PackedDrawing } from "../map/drawing";
import { type LoadedGraph, loadDrawing, loadGraph } from "../map/loaded";
import { MapCanvas, type MapHandle, type Pointed } from "../map/MapCanvas";
import { EMPTY_SCENE, type Mark, type Moving, type Scene } from "../map/scene";
import { REPLAY_SPEEDS } from "../run/figures";
import { type Crowd, nearest } from "../run/frames";
import { usePlaying } from "../run/usePlaying";
import { go } from "../ui/address";
import { IconPause, IconPlay } from "../ui/icons";
import { tellError } from "../ui/notices";
import { useLoaded } from "../ui/useLoaded";
import { MapFit } from "./MapFit";
import { RecordedMoments } from "./moments";
import { PartForm } from "./PartForm";
import { SceneList } from "./SceneList";
import { SceneSearch } from "./SceneSearch";
import { TimeBar } from "./TimeBar";
import { type Part, partBetween, partOf } from "./window";
import { egoOf, KINDS, recordedTime } from "./words";

/** Seconds of the part that is chosen at first. */
const FIRST_PART = 20;
/** Metres around the tracks that are in sight at first, and of ground without a map. */
const MARGIN = 15;
const PLAIN: Scene = { ...EMPTY_SCENE, nodes: { vehicles: false, walks: false, inside: null } };

/** A recording: looked at by time on its map, and made scenarios of. */
export function RecordingView({ recording }: { recording: string }) {
  const { value, error, reload } = useLoaded(useCallback(() => recordings.info(recording), [recording]));
  if (error)
    return (
      <div className="catalogue">
        <Alert color="red" title={t`The recording cannot be shown`}>
          {error}
        </Alert>
        <Button mt="md" onClick={() => go({ view: "catalogue" })}>
          <Trans>Back to the maps</Trans>
        </Button>
      </div>
    );
  if (!value)
    return (
      <div className="empty">
        <Loader aria-label={t`Loading the recording`} />
      </div>
    );
  // Placed anew, it is another one.
  return <Shown key={`${value.map} ${value.offset.join(" ")}`} info={value} onPlaced={reload} />;
}

interface Ground {
  drawing: PackedDrawing;
  loaded: LoadedGraph | null;
}

/** Ground of a recording without a map. */
function emptyGround([x0, y0, x1, y1]: Bounds): Ground {
  const none = { sizes: [], steps: [] };
  const drawing: PackedDrawing = {
    format: "",
    version: 1,
    name: "",
    bounds: [x0 - MARGIN, y0 - MARGIN, x1 + MARGIN, y1 + MARGIN],
    areas: [],
    marks: [],
    symbols: [],
    crosswalks: none,
    bars: none,
    stop_lines: none,
    parking_spaces: none,
    buildings: none,
  };
  return { drawing, loaded: null };
}

function Shown({ info, onPlaced }: { info: RecordingInfo; onPlaced: () => void }) {
  const { map, bounds } = info;
  const ground = useLoaded(
    useCallback(async (): Promise<Ground> => {
      if (map === null) return emptyGround(bounds);
      const [drawing, loaded] = await Promise.all([loadDrawing(map), loadGraph(map)]);
      return { drawing, loaded };
    }, [map, bounds]),
  );
  const handle = useRef<MapHandle | null>(null);
  const [part, setPart] = useState<Part>(() => partBetween(info.begin, info.begin + FIRST_PART, info));
  const [ego, setEgo] = useState<string | null>(null);
  const [kinds, setKinds] = useState<readonly SceneKind[]>(() =>
    KINDS.filter((kind) => kind !== "lane_change"),
  );
  const [chosen, setChosen] = useState<RecordedScene | null>(null);
  const [count, setCount] = useState(0);
  const last = useRef<{ crowd: Crowd; moving: Moving } | null>(null);
  const egoNow = useRef(ego);
  egoNow.current = ego;
  countFrom(0);

  const [come, setCome] = useState(0);
  // Where they were does not change while its scenes are looked for.
  const [moments] = useState(() => new RecordedMoments(info, () => setCome((n) => n + 1), tellError));
  const show = useCallback(
    (time: number) => {
      const found = moments.at(time);
      if (!found) return;
      const moving = found.crowd.arrange(found.frame, egoNow.current);
      last.current = { crowd: found.crowd, moving };
      handle.current?.setMoving(moving);
      setCount(moving.count);
    },
    [moments],
  );
  const player = usePlaying(info, show);
  const { time, seek, start, pause } = player;
  useEffect(() => start(info.begin), [start, info.begin]);
  useEffect(() => show(time), [show, time, come, ego, ground.value]);
  const placed = useRef(false);
  useEffect(() => {
    if (!ground.value || placed.current) return;
    placed.current = true;
    const [x0, y0, x1, y1] = bounds;
    handle.current?.show([x0 - MARGIN, y0 - MARGIN, x1 + MARGIN, y1 + MARGIN]);
  }, [ground.value, bounds]);

  const scenes = useMemo(() => info.scenes.filter(({ kind }) => kinds.includes(kind)), [info, kinds]);
  const marks = useMemo<Mark[]>(
    () => (chosen ? [{ x: chosen.x, y: chosen.y, kind: "rule", fresh: true }] : []),
    [chosen],
  );
  useEffect(() => handle.current?.setMarks(marks), [marks, ground.value]);
  const choose = useCallback(
    (scene: RecordedScene): void => {
      setChosen(scene);
      setPart(partOf(scene, info));
      const wanted = egoOf(scene);
      setEgo(wanted);
      pause();
      seek(scene.begin);
      handle.current?.reveal(scene.x, scene.y);
    },
    [info, pause, seek],
  );
  const pick = ({ x, y, reach }: Pointed): void => {
    if (!last.current) return;
    const { crowd, moving } = last.current;
    const id = nearest(crowd, moving, x, y, Math.max(reach, 3));
    const user = info.users.find((one) => one.id === id);
    if (user && user.category !== "pedestrian") setEgo(user.id);
  };
  if (!ground.value)
    return (
      <div className="empty">
        {ground.error ? (
          <Alert color="red" title={t`The map cannot be shown`}>
            {ground.error}
          </Alert>
        ) : (
          <Loader aria-label={t`Loading the map`} />
        )}
      </div>
    );
  const { drawing, loaded } = ground.value;
  const speed = REPLAY_SPEEDS().find((one) => one.speed === player.speed);
  return (
    <div className="run recording">
      <div className="run-body">
        <div className="run-map">
          <MapCanvas
            drawing={drawing}
            graph={loaded?.graph ?? null}
            picker={loaded?.picker ?? null}
            scene={PLAIN}
            handle={handle}
            label={map === null ? t`The recording without a map` : t`The recording on the map ${map}`}
            aim
            onPick={pick}
          >
            <div className="map-hint" role="status">
              {ego === null ? t`Click a vehicle: it becomes the ego.` : t`Ego: ${ego}`}
            </div>
          </MapCanvas>
        </div>
        <section className="run-side" aria-label={t`The recording`}>
          <div className="run-panel">
            <Title order={1} size="h4" style={{ overflowWrap: "anywhere" }}>
              {info.file}
            </Title>
            <Text size="sm" c="dimmed" mb="md">
              <Trans>
                {info.users.length} road users from {recordedTime(info, info.begin)} to{" "}
                {recordedTime(info, info.end)}, schema {info.published_schema}
              </Trans>
            </Text>
            <section aria-labelledby="recording-map">
              <Title order={2} size="h5" id="recording-map">
                <Trans>Map</Trans>
              </Title>
              <MapFit info={info} onPlaced={onPlaced} />
            </section>
            <section aria-labelledby="recording-scenes">
              <Title order={2} size="h5" id="recording-scenes" mt="lg" mb={6}>
                <Trans>Scenes found</Trans>
              </Title>
              {!info.searched && <SceneSearch recording={info.name} onSearched={onPlaced} />}
              <SceneList
                info={info}
                kinds={kinds}
                onKinds={setKinds}
                scenes={scenes}
                chosen={chosen}
                onChoose={choose}
              />
            </section>
            <section aria-labelledby="recording-part">
              <Title order={2} size="h5" id="recording-part" mt="lg" mb={6}>
                <Trans>A scenario of a part</Trans>
              </Title>
              <PartForm info={info} part={part} ego={ego} onEgo={setEgo} />
            </section>
          </div>
        </section>
      </div>
      <div className="strip" role="region" aria-label={t`Time of the recording`}>
        <Group gap={6} role="group" aria-label={t`Control the recording`}>
          {player.playing ? (
            <Button leftSection={<IconPause />} onClick={pause}>
              <Trans>Pause</Trans>
            </Button>
          ) : (
            <Button leftSection={<IconPlay />} onClick={player.play}>
              <Trans>Play</Trans>
            </Button>
          )}
          <Select
            aria-label={t`Speed`}
            w={120}
            data={REPLAY_SPEEDS().map(({ value, label }) => ({ value, label }))}
            allowDeselect={false}
            value={speed?.value ?? null}
            onChange={(value) =>
              player.setSpeed(REPLAY_SPEEDS().find((one) => one.value === value)?.speed ?? 1)
            }
          />
        </Group>
        <TimeBar
          info={info}
          scenes={scenes}
          time={time}
          part={part}
          onSeek={(to) => {
            pause();
            seek(to);
          }}
          onPart={(next) => {
            setPart(next);
            setChosen(null);
          }}
        />
        <div className="figure">
          <b>{recordedTime(info, time)}</b>
          <span>{t`of ${recordedTime(info, info.end)}`}</span>
        </div>
        <div className="figure">
          <b>{count}</b>
          <span>{t`On the road`}</span>
        </div>
      </div>
    </div>
  );
}
