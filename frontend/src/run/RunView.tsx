import { i18n } from "@lingui/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import "./run.css";

import { Loader, Tabs, VisuallyHidden } from "@mantine/core";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import type { FitRow } from "../api/runs";
import type { Category } from "../api/types";
import { type LightProgram, signals } from "../api/signals";
import { CameraPanel } from "../carla/CameraPanel";
import { MapCanvas, type MapHandle, type Pointed } from "../map/MapCanvas";
import { seenInLog } from "../signals/occupancy";
import { sceneDetectors } from "../signals/sceneDetectors";
import { SignalPanel } from "../signals/SignalPanel";
import { useQueues } from "../signals/useQueues";
import { useRunLights } from "../signals/useSignals";
import { loggedPlans, plannedPlans } from "../time/plans";
import { RunBar } from "../time/RunBar";
import { useNearest } from "../time/useNearest";
import { go } from "../ui/address";
import { keep, parseKept } from "../ui/kept";
import { CountsFit } from "./CountsFit";
import { EarlierRuns } from "./EarlierRuns";
import { hasEnded } from "./figures";
import { countMarks } from "./fit";
import type { Crowd } from "./frames";
import { IncidentLog } from "./IncidentLog";
import { LaneTools } from "./LaneTools";
import { QUANTITIES } from "./laneUse";
import { markKind, marksAt } from "./incidents";
import { Legend } from "./Legend";
import { Live } from "./live";
import { SafeSlices } from "./LongRun";
import { Plots } from "./Plots";
import { Result } from "./Result";
import { RoadUsers } from "./RoadUsers";
import { MapTools } from "./MapTools";
import { RunGone } from "./RunGone";
import { RunHint } from "./RunHint";
import { ShareMenu } from "./ShareMenu";
import { SpeedChart } from "./SpeedChart";
import { LiveStrip, ReplayStrip } from "./Strip";
import { useCounts } from "./useCounts";
import { useIncidents } from "./useIncidents";
import { useLaneUse } from "./useLaneUse";
import { usePicture } from "./usePicture";
import { useReplay } from "./useReplay";
import { useGround, useRun } from "./useRun";

/** Watches one run from above; one that is resumed is watched anew. */
export function RunView({ scenario, run }: { scenario: string; run: string }) {
  const [turn, setTurn] = useState(0);
  return <Watched key={turn} scenario={scenario} run={run} onResume={() => setTurn(turn + 1)} />;
}

/** A run, live or as it was recorded; the scenario itself is not touched. */
function Watched({ scenario, run, onResume }: { scenario: string; run: string; onResume: () => void }) {
  const handle = useRef<MapHandle | null>(null);
  // What the address kept when the run was opened.
  const [linked] = useState(() => parseKept(location.hash));
  const { info, failure, lost, learn } = useRun(run);
  const ground = useGround(info?.map ?? null, scenario);
  const picture = usePicture(handle);
  const { show, redraw, clear, follow, followed, latest, now } = picture;
  const ended = info !== null && hasEnded(info.state);
  const over = useRef(ended);
  over.current = ended;
  const complete = ended && info.summary != null;
  const [crowd, setCrowd] = useState<Crowd | null>(null);
  // A run that has ended is opened as its recording; one that was watched keeps its last picture.
  const [mode, setMode] = useState<"live" | "replay" | null>(null);
  if (info && mode === null) setMode(ended ? "replay" : "live");
  const replayable = complete && info.state !== "failed" && info.state !== "interrupted";
  const player = useReplay(run, mode === "replay" && replayable, show);
  const { incidents, add } = useIncidents(run, complete);
  const counts = useCounts(run, replayable);
  const [fit, setFit] = useState<readonly FitRow[] | null>(null);
  const [tab, setTab] = useState<string | null>(null);
  const shownTab = tab ?? (ended ? "result" : "users");

  const { map, drawing, loaded } = ground;
  const laneUse = useLaneUse(run, loaded);
  const lights = useRunLights(run, map, mode === "replay" && replayable);
  const { learn: learnLights, learnDetectors, drawn } = lights;
  const [junction, setJunction] = useState<string | null>(null);
  const shownJunction = junction ?? lights.heads?.junctions[0] ?? null;
  const history = shownJunction === null ? null : lights.history(shownJunction);
  const queues = useQueues({ map, graph: loaded?.graph ?? null, junction: shownJunction, picture });
  const [program, setProgram] = useState<LightProgram | null>(null);
  // Anew at the end, when there are the calls of detectors.
  const source = useMemo(() => ({ run, complete }), [run, complete]);
  const loadProgram = useCallback((of: string) => signals.ofRun(source.run, of), [source]);
  const ttc = useNearest(player.replay, crowd);
  const { learn: learnTtc } = ttc;
  useEffect(() => {
    if (mode !== "live") return;
    const live = new Live(run, {
      onFrame: (frame, of) => {
        show(frame, of);
        learnTtc(frame, of);
      },
      onIntroduced: setCrowd,
      onIncidents: add,
      onLights: (changed) => learnLights(changed, latest()?.frame.time ?? 0),
      onDetectors: learnDetectors,
      onState: learn,
      hasEnded: () => over.current,
    });
    return () => live.close();
  }, [run, mode, show, add, learn, learnTtc, learnLights, learnDetectors, latest]);
  // What has come before the map is drawn with it, so that nothing is missing or flickers.
  useEffect(() => redraw(), [redraw, drawing, loaded]);
  const { turn } = lights;

  // A fast run may end between two pictures: no road user stays that has arrived.
  const cleared = mode === "live" && ended && info.progress?.running === 0;
  useEffect(() => {
    if (cleared) clear();
  }, [cleared, clear]);
  useEffect(() => {
    if (ground.bounds && !linked.at) handle.current?.show(ground.bounds);
  }, [ground.bounds, linked]);
  const { replay, seek } = player;
  useEffect(() => {
    if (!replay) return;
    const { time: at, chosen } = linked;
    if (at !== undefined) seek(at);
    if (chosen?.[0]) follow(chosen[0]);
  }, [replay, seek, follow, linked]);
  useEffect(() => {
    if (replay) keep({ time: player.time, chosen: followed ? [followed] : [] });
  }, [replay, player.time, followed]);
  const known = player.replay?.crowd ?? crowd;
  const recorded = useMemo(
    () => (player.replay && followed ? player.replay.speedsOf(followed) : null),
    [player.replay, followed],
  );
  const speeds = recorded ?? picture.speeds;
  const categories = useMemo(
    () => new Map<string, Category>(known?.all().map((one) => [one.id, one.category]) ?? []),
    [known],
  );
  const kinds = useMemo(() => new Set(categories.values()), [categories]);
  const marks = useMemo(
    () => new Set(fit ? countMarks(fit).map(({ kind }) => kind) : incidents.map(markKind)),
    [incidents, fit],
  );
  const reached = player.replay?.end ?? now.time;
  const longest = (ended ? Math.max(player.replay?.end ?? 0, now.time) : info?.progress?.until) || 60;
  // What was logged is what ran; a live run has a plan only.
  const plans = history?.plans
    ? loggedPlans(history.times, history.plans, reached)
    : program
      ? plannedPlans(program, longest)
      : [];
  const time = mode === "replay" ? player.time : ended ? Infinity : now.time;
  useEffect(() => {
    handle.current?.setHeads(drawn(time));
  }, [drawn, time, turn, drawing, loaded]);
  const { occupied } = lights;
  const second = mode === "replay" ? Math.floor(time) : 0;
  const scene = useMemo(() => {
    const lanes = { ...ground.scene, laneColors: laneUse.colors };
    if (!program) return lanes;
    const on = mode === "live" ? occupied : seenInLog(program.detectors, second)?.on;
    return { ...lanes, detectors: sceneDetectors(program, on) };
  }, [ground.scene, program, mode, occupied, second, laneUse.colors]);
  const pick = (at: Pointed): void => {
    laneUse.point(at);
    const user = picture.near(at);
    const light = user === null ? lights.heads?.junctionAt(at) : null;
    if (light) {
      setJunction(light);
      setTab("lights");
    } else follow(user);
  };
  useEffect(() => {
    handle.current?.setMarks(fit ? countMarks(fit) : marksAt(incidents, time));
  }, [incidents, fit, time, drawing, loaded]);

  const jump = (at: number): void => {
    player.pause();
    player.seek(at);
  };
  const back = (): void => go({ view: "editor", scenario });
  const wrong = failure ?? ground.failure;
  if (wrong)
    return <RunGone scenario={scenario} reason={wrong} watched={info !== null && failure !== null} />;
  if (!info)
    return (
      <div className="empty">
        <Loader aria-label={t`Loading the run`} />
      </div>
    );
  return (
    <div className="run">
      <VisuallyHidden component="h1">{t`Run ${run}`}</VisuallyHidden>
      <div className="run-body">
        <div className="run-map">
          {drawing ? (
            <MapCanvas
              drawing={drawing}
              graph={loaded?.graph ?? null}
              picker={loaded?.picker ?? null}
              scene={scene}
              handle={handle}
              label={mode === "replay" ? t`Recording of the run` : t`Live view of the run`}
              onPick={pick}
              onPoint={(at) => {
                if (at && laneUse.by) laneUse.point(at);
              }}
            >
              <RunHint
                info={info}
                lost={lost}
                planned={crowd !== null}
                followed={followed}
                there={now.there}
              />
              <Legend
                categories={kinds}
                ego={(known?.egos().length ?? 0) > 0}
                lights={lights.known && (map?.lights.length ?? 0) > 0}
                lamps={mode === "live"}
                marks={marks}
                by={picture.by}
                lanes={
                  laneUse.by && laneUse.legend && { ...laneUse.legend, word: QUANTITIES()[laneUse.by].word }
                }
              />
              <MapTools
                by={picture.by}
                live={mode === "live"}
                onBy={picture.colourBy}
                share={
                  <ShareMenu
                    run={run}
                    handle={handle}
                    playing={mode === "replay" ? player.playing : null}
                    onPlay={player.play}
                  />
                }
              >
                {mode === "replay" && replayable && <LaneTools shown={laneUse} />}
                {followed && speeds.length > 1 && (
                  <SpeedChart
                    name={followed}
                    points={speeds}
                    time={mode === "replay" ? player.time : now.time}
                    gap={Math.max(1, 1.5 * (player.replay?.spacing ?? 0))}
                  />
                )}
              </MapTools>
            </MapCanvas>
          ) : (
            <div className="empty">
              <Loader aria-label={t`Loading the map`} />
            </div>
          )}
        </div>
        <aside className="run-side" aria-label={t`About the run`}>
          {info.carla && mode === "live" && <CameraPanel run={run} over={ended} />}
          <Tabs className="run-tabs" value={shownTab} onChange={setTab} keepMounted={false}>
            <Tabs.List>
              {ended && (
                <Tabs.Tab value="result">
                  <Trans>Result</Trans>
                </Tabs.Tab>
              )}
              {replayable && (
                <Tabs.Tab value="charts">
                  <Trans>Charts</Trans>
                </Tabs.Tab>
              )}
              {counts > 0 && (
                <Tabs.Tab value="counts">
                  <Trans>Counts</Trans>
                </Tabs.Tab>
              )}
              <Tabs.Tab value="users">
                <Trans>Road users</Trans>
              </Tabs.Tab>
              <Tabs.Tab value="incidents">
                <Trans>
                  Incidents{incidents.length > 0 && ` (${incidents.length.toLocaleString(i18n.locale)})`}
                </Trans>
              </Tabs.Tab>
              {shownJunction && (
                <Tabs.Tab value="lights">
                  <Trans>Lights</Trans>
                </Tabs.Tab>
              )}
              <Tabs.Tab value="runs">
                <Trans>Runs</Trans>
              </Tabs.Tab>
            </Tabs.List>
            <Tabs.Panel value="result" className="run-panel">
              <Result
                info={info}
                scenario={scenario}
                onBack={back}
                onResume={onResume}
                onShow={mode === "replay" ? jump : null}
              />
            </Tabs.Panel>
            <Tabs.Panel value="charts" className="run-panel">
              <Plots run={run} />
            </Tabs.Panel>
            <Tabs.Panel value="counts" className="run-panel">
              <CountsFit
                run={run}
                onFit={setFit}
                onShow={(x, y) => {
                  follow(null);
                  handle.current?.centre(x, y);
                }}
              />
            </Tabs.Panel>
            <Tabs.Panel value="users" className="run-panel">
              {!ended && <SafeSlices info={info} />}
              <RoadUsers picture={picture} wanted={shownTab === "users"} />
            </Tabs.Panel>
            <Tabs.Panel value="incidents" className="run-panel">
              <IncidentLog
                incidents={incidents}
                categories={categories}
                over={ended}
                onShow={({ x, y, time: at }) => {
                  follow(null);
                  if (mode === "replay") jump(at);
                  if (x !== undefined && y !== undefined) handle.current?.centre(x, y);
                }}
              />
            </Tabs.Panel>
            {shownJunction && lights.heads && (
              <Tabs.Panel value="lights" className="run-panel">
                <SignalPanel
                  junctions={lights.heads.junctions}
                  junction={shownJunction}
                  onJunction={(next) => {
                    setJunction(next);
                    const middle = lights.heads?.middle(next);
                    follow(null);
                    if (middle) handle.current?.centre(middle.x, middle.y);
                  }}
                  load={loadProgram}
                  now={lights.now(shownJunction, mode === "replay" ? player.time : now.time)}
                  occupied={mode === "live" && !complete ? lights.occupied : null}
                  queues={queues}
                  onShown={setProgram}
                />
              </Tabs.Panel>
            )}
            <Tabs.Panel value="runs" className="run-panel">
              <EarlierRuns
                scenario={scenario}
                current={run}
                onRemoved={(removed) => {
                  if (removed === run) go({ view: "runs", scenario });
                }}
              />
            </Tabs.Panel>
          </Tabs>
        </aside>
      </div>
      <RunBar
        end={longest}
        reached={reached}
        time={mode === "replay" ? player.time : now.time}
        incidents={incidents}
        categories={categories}
        junction={shownJunction}
        history={history}
        plans={plans}
        ttc={ttc}
        spacing={player.replay?.spacing ?? 0.2}
        onSeek={player.replay ? jump : null}
        onShow={({ x, y }) => {
          follow(null);
          if (x !== undefined && y !== undefined) handle.current?.centre(x, y);
        }}
      />
      {ended && mode !== null ? (
        <ReplayStrip
          player={player}
          recorded={replayable}
          running={now.running}
          incidents={incidents}
          onBack={back}
          onPlay={() => {
            setMode("replay");
            player.play();
          }}
        />
      ) : (
        <LiveStrip info={info} now={now} onBack={back} learn={learn} />
      )}
    </div>
  );
}
