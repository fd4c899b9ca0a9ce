import { Alert, Button, Group, Loader, Paper, Progress, Select, Text, Title } from "@mantine/core";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import { api } from "../api/client";
import { CATEGORIES, type MapInfo, type RunInfo, type ScenarioDocument } from "../api/types";
import type { PackedDrawing } from "../map/drawing";
import { CATEGORY_COLOR } from "../map/colors";
import { insideRows, segmentsBounds } from "../editor/scene";
import { type LoadedGraph, loadDrawing, loadGraph } from "../map/loaded";
import { MapCanvas, type MapHandle, type Pointed } from "../map/MapCanvas";
import { EMPTY_SCENE, type Moving, type Scene } from "../map/scene";
import { CategoryGlyph, IconBack, IconPause, IconPlay, IconStep, IconStop } from "../ui/icons";
import { tellError } from "../ui/notices";
import { go } from "../ui/route";
import { CATEGORY_WORD, clock } from "../ui/words";
import { hasEnded, keyFigures, SPEEDS, STATE_WORD } from "./figures";
import type { Crowd, Frame } from "./frames";
import { lamps } from "./lights";
import { Live } from "./live";

const POLL = 700;
/** How often results are asked for after the end; a stopped run may have none. */
const ENOUGH = 20;

interface Now {
  time: number;
  pace: number;
  running: number;
  arrived: number;
}

/** Watches one run from above; the scenario itself is not touched. */
export function RunView({ scenario, run }: { scenario: string; run: string }) {
  const handle = useRef<MapHandle | null>(null);
  const [drawing, setDrawing] = useState<PackedDrawing | null>(null);
  const [loaded, setLoaded] = useState<LoadedGraph | null>(null);
  const [document, setDocument] = useState<ScenarioDocument | null>(null);
  const [info, setInfo] = useState<RunInfo | null>(null);
  const [now, setNow] = useState<Now>({ time: 0, pace: 0, running: 0, arrived: 0 });
  const [speed, setSpeed] = useState("1");
  const [followed, setFollowed] = useState<string | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  const mapInfo = useRef<MapInfo | null>(null);
  const last = useRef<{ frame: Frame; crowd: Crowd; moving: Moving } | null>(null);
  const watching = useRef<{ ego: string | null; followed: string | null }>({ ego: null, followed: null });
  const state = info?.state ?? "preparing";
  const ended = hasEnded(state);
  // The last picture is still sent after the end: the connection is left to close itself.
  const over = useRef(false);
  useEffect(() => { over.current = ended; }, [ended]);
  // The live picture may tell of the end before the results are there.
  const complete = ended && (info?.summary != null || state === "failed");

  useEffect(() => {
    const fail = (error: unknown): void => setFailure(String((error as Error).message));
    api.scenario(scenario).then(async ({ document: found }) => {
      setDocument(found);
      watching.current.ego = found.actors.find((actor) => actor.ego)?.id ?? null;
      mapInfo.current = await api.map(found.map.name);
      setDrawing(await loadDrawing(found.map.name));
      setLoaded(await loadGraph(found.map.name));
    }).catch(fail);
  }, [scenario]);

  // How the run stands; asked rarely, as the picture comes by itself.
  useEffect(() => {
    if (complete) return;
    let current = true;
    let left = ENOUGH;
    const ask = (): void => {
      if (ended && left-- <= 0) return;
      api.run(run).then(
        (found) => { if (current) setInfo(found); },
        (error: unknown) => { if (current) setFailure(String((error as Error).message)); });
    };
    ask();
    const timer = setInterval(ask, POLL);
    return () => { current = false; clearInterval(timer); };
  }, [run, ended, complete]);

  const draw = useCallback(() => {
    if (!last.current) return;
    const { frame, crowd } = last.current;
    const moving = crowd.arrange(frame, watching.current.ego, watching.current.followed);
    last.current.moving = moving;
    handle.current?.setMoving(moving);
    if (moving.followed >= 0) {
      handle.current?.centre(moving.pose[5 * moving.followed], moving.pose[5 * moving.followed + 1]);
    }
  }, []);

  useEffect(() => {
    if (over.current || !drawing) return;
    let shown = 0;
    const states = new Map<string, string>();
    const live = new Live(run, {
      onFrame: (frame, crowd) => {
        last.current = { frame, crowd, moving: last.current?.moving ?? crowd.arrange(frame, null, null) };
        draw();
        if (performance.now() - shown < 100) return;
        shown = performance.now();
        setNow({ time: frame.time, pace: frame.pace, running: frame.count, arrived: frame.arrived });
      },
      onLights: (changed) => {
        for (const [id, state] of Object.entries(changed)) states.set(id, state);
        if (mapInfo.current) handle.current?.setLamps(lamps(mapInfo.current, states));
      },
      onState: (next) => setInfo((old) => (old ? { ...old, state: next } : { state: next })),
      onClose: () => undefined,
    });
    return () => live.close();
  }, [run, drawing, draw]);

  // A fast run may end between two pictures: nobody stays on the road who has arrived.
  const cleared = ended && info?.progress?.running === 0;
  useEffect(() => {
    if (!cleared) return;
    last.current = null;
    handle.current?.setMoving(null);
  }, [cleared]);

  const bounds = useMemo(
    () => loaded && document ? segmentsBounds(loaded.graph, document.roi) : null, [loaded, document]);
  useEffect(() => { if (bounds) handle.current?.show(bounds); }, [bounds]);
  const scene = useMemo<Scene>(() => ({
    ...EMPTY_SCENE,
    nodes: { vehicles: false, walks: false, inside: loaded && document ? insideRows(loaded.graph, document.roi) : null },
  }), [loaded, document]);

  const control = (action: string, value?: number | null): void => {
    api.control(run, action, value).then(
      () => {
        if (action === "pause" || action === "resume") {
          setInfo((old) => (old ? { ...old, state: action === "pause" ? "paused" : "running" } : old));
        }
      }, tellError);
  };
  const follow = (id: string | null): void => {
    setFollowed(id);
    watching.current.followed = id;
    draw();
  };
  const pick = (at: Pointed): void => {
    if (!last.current) return;
    const { moving, frame, crowd } = last.current;
    follow(nearestMoving(moving, frame, crowd, at));
  };
  const back = (): void => go({ view: "editor", scenario });

  if (failure) {
    return (
      <div className="catalogue">
        <Alert color="red" title="This run cannot be shown">{failure}</Alert>
        <Button mt="md" onClick={back}>Back to the editor</Button>
      </div>
    );
  }
  const until = info?.progress?.until ?? document?.simulation.duration ?? 0;
  const time = ended ? (info?.progress?.time ?? now.time) : now.time;
  return (
    <div className="run">
      <div className="run-map">
        {drawing
          ? <MapCanvas drawing={drawing} graph={loaded?.graph ?? null} picker={loaded?.picker ?? null} scene={scene} handle={handle}
              label="Live view of the run" onPick={pick}>
              {state === "preparing" && <div className="map-hint" role="status">Getting ready …</div>}
              {followed && <div className="map-hint" role="status">Following {followed}. Click on the empty map to stop.</div>}
              <KindLegend document={document} />
            </MapCanvas>
          : <div className="empty"><Loader aria-label="Loading the map" /></div>}
        {info && ended && <Result info={info} run={run} onBack={back} scenario={scenario} />}
      </div>
      <div className="strip" role="region" aria-label="The run">
        <Button variant="default" leftSection={<IconBack />} onClick={back}>Back to the editor</Button>
        <Group gap={6} role="group" aria-label="Control the run">
          {state === "paused"
            ? <Button leftSection={<IconPlay />} onClick={() => control("resume")}>Go on</Button>
            : <Button leftSection={<IconPause />} disabled={ended || state === "preparing"} onClick={() => control("pause")}>Pause</Button>}
          <Button variant="default" leftSection={<IconStep />} disabled={state !== "paused"} onClick={() => control("step")}>One step</Button>
          <Button variant="default" leftSection={<IconStop />} disabled={ended} onClick={() => control("stop")}>Stop</Button>
          <Select aria-label="Speed" w={160} data={SPEEDS.map(({ value, label }) => ({ value, label }))} value={speed} allowDeselect={false} disabled={ended}
            onChange={(value) => {
              const found = SPEEDS.find((one) => one.value === value);
              if (!found) return;
              setSpeed(found.value);
              control("speed", found.speed);
            }} />
        </Group>
        <div className="time-line">
          <Progress value={until ? Math.min(100, (100 * time) / until) : 0} aria-label="How much of the run is over" />
          <Text size="sm" mt={4}>{STATE_WORD[state] ?? state}</Text>
        </div>
        <Shown label="Time" value={clock(time)} />
        <Shown label="Times real speed" value={ended ? "–" : now.pace.toFixed(1)} />
        <Shown label="On the road" value={ended ? "–" : String(now.running)} />
        <Shown label="Arrived" value={String(ended ? (info?.progress?.arrived ?? now.arrived) : now.arrived)} />
      </div>
    </div>
  );
}

function nearestMoving(moving: Moving, frame: Frame, crowd: Crowd, at: Pointed): string | null {
  let best: string | null = null;
  let least = Math.max(at.reach, 3);
  for (let i = 0; i < frame.count; i++) {
    const who = crowd.named(frame.rows[6 * i]);
    const row = who ? crowd.row(who.id) : -1;
    if (!who || row < 0) continue;
    const away = Math.hypot(moving.pose[5 * row] - at.x, moving.pose[5 * row + 1] - at.y);
    if (away < least) [best, least] = [who.id, away];
  }
  return best;
}

function Shown({ label, value }: { label: string; value: string }) {
  return <div className="figure"><b>{value}</b><span>{label}</span></div>;
}

function KindLegend({ document }: { document: ScenarioDocument | null }) {
  const kinds = CATEGORIES.filter((one) => document?.actors.some((actor) => actor.category === one));
  if (kinds.length === 0) return null;
  return (
    <div className="map-legend" aria-hidden="true">
      {kinds.map((kind) => <span key={kind}><i style={{ background: CATEGORY_COLOR[kind] }} /><CategoryGlyph category={kind} size={16} />{CATEGORY_WORD[kind]}</span>)}
    </div>
  );
}

function Result({ info, run, scenario, onBack }: {
  info: RunInfo; run: string; scenario: string; onBack: () => void;
}) {
  const [busy, setBusy] = useState(false);
  const again = (): void => {
    setBusy(true);
    api.startRun(scenario).then(
      ({ run: next }) => go({ view: "run", scenario, run: next }),
      (error: unknown) => { setBusy(false); tellError(error); });
  };
  const error = typeof info.error === "string" ? info.error : info.error?.message;
  return (
    <Paper className="result" withBorder shadow="md" p="lg" role="region" aria-label="Result of the run">
      <Title order={2} size="h3">{info.state === "failed" ? "The run failed" : info.state === "stopped" ? "The run was stopped" : "The run is finished"}</Title>
      {info.state === "failed" && <Alert color="red" mt="sm" style={{ whiteSpace: "pre-wrap", overflowWrap: "anywhere" }}>{error ?? "No reason is known."}</Alert>}
      {info.summary && (
        <dl className="figures">
          {keyFigures(info.summary).map(({ label, value }) => (
            <div className="figure" key={label} style={{ flexDirection: "column-reverse", display: "flex" }}>
              <dt style={{ fontSize: 12 }}>{label}</dt><dd style={{ margin: 0, fontSize: 19, fontWeight: 700 }}>{value}</dd>
            </div>
          ))}
        </dl>
      )}
      <Group mt="md" gap="xs">
        <Button onClick={onBack}>Back to the editor</Button>
        {info.summary && <Button variant="default" component="a" href={api.reportUrl(run)} target="_blank" rel="noreferrer">Full report</Button>}
        <Button variant="default" loading={busy} onClick={again}>Run again</Button>
      </Group>
    </Paper>
  );
}
