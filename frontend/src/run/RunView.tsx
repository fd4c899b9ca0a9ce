import { t } from "@lingui/core/macro";

import "./run.css";

import { Loader, VisuallyHidden } from "@mantine/core";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import type { FitRow } from "../api/runs";
import type { Category } from "../api/types";
import { type LightProgram, signals } from "../api/signals";
import { MOST_ACTORS } from "../editor/scene";
import { around } from "../editor/sights";
import { countFrom } from "../language/moments";
import type { Pointed } from "../map/MapCanvas";
import { NO_NAMES } from "../map/placeNames";
import { seenInLog } from "../signals/occupancy";
import { sceneDetectors } from "../signals/sceneDetectors";
import { useQueues } from "../signals/useQueues";
import { useRunLights } from "../signals/useSignals";
import { loggedPlans, plannedPlans } from "../time/plans";
import { RunBar } from "../time/RunBar";
import { useNearest } from "../time/useNearest";
import { go } from "../ui/address";
import { keep, parseKept } from "../ui/kept";
import { hasEnded } from "./figures";
import { countMarks } from "./fit";
import type { Crowd } from "./frames";
import { markKind, marksAt } from "./incidents";
import { limitsOf } from "./limits";
import { Live } from "./live";
import { RunGone } from "./RunGone";
import { RunMap } from "./RunMap";
import { RunSide } from "./RunSide";
import { LiveStrip, ReplayStrip } from "./Strip";
import { useContent } from "./useContent";
import { useIncidents } from "./useIncidents";
import { useLightsAhead } from "./useLightsAhead";
import { useLaneData } from "./useLaneUse";
import { usePicture } from "./usePicture";
import { useReplay } from "./useReplay";
import { useViews } from "./useViews";
import { viewName } from "./ViewButtons";
import { useGround, useRun } from "./useRun";

/** Metres around where the road users of a story have been. */
const STORY_MARGIN = 20;
/** Seconds of a long live run of few road users that are in sight first. */
const STORY = 60;

/** Watches one run from above; one that is resumed is watched anew. */
export function RunView({ scenario, run }: { scenario: string; run: string }) {
  const [turn, setTurn] = useState(0);
  return <Watched key={turn} scenario={scenario} run={run} onResume={() => setTurn(turn + 1)} />;
}

/** A run, live or as it was recorded; the scenario itself is not touched. */
function Watched({ scenario, run, onResume }: { scenario: string; run: string; onResume: () => void }) {
  // What the address kept when the run was opened.
  const [linked] = useState(() => parseKept(location.hash));
  const { info, failure, lost, learn } = useRun(run);
  const ground = useGround(info?.map ?? null, scenario);
  const { map, drawing, loaded } = ground;
  const [mode, setMode] = useState<"live" | "replay" | null>(null);
  const views = useViews(linked);
  const { used, handleOf, follow } = views;
  const limitOf = useMemo(() => loaded && limitsOf(loaded), [loaded]);
  // A recording has no lamps.
  const sights = useMemo(
    () =>
      views.list.map((one) =>
        mode === "replay" && one.by === "lamps" ? { ...one, by: "kind" as const } : one,
      ),
    [views.list, mode],
  );
  const ended = info !== null && hasEnded(info.state);
  const complete = ended && info.summary != null;
  const replayable = complete && info.state !== "failed" && info.state !== "interrupted";
  const lights = useRunLights(run, map, mode === "replay" && replayable);
  const aheadOf = useLightsAhead(sights, map, loaded, lights.stateOf);
  const picture = usePicture(sights, handleOf, limitOf, aheadOf);
  const { show, clear, latest, now } = picture;
  const over = useRef(ended);
  over.current = ended;
  const [crowd, setCrowd] = useState<Crowd | null>(null);
  // A run that has ended is opened as its recording; one that was watched keeps its last picture.
  if (info && mode === null) setMode(ended ? "replay" : "live");
  const player = useReplay(run, mode === "replay" && replayable, show);
  const { incidents, add } = useIncidents(run, complete);
  const content = useContent(run, replayable);
  countFrom(info?.clock ?? content?.clock ?? 0);
  const [fit, setFit] = useState<readonly FitRow[] | null>(null);
  const [tab, setTab] = useState<string | null>(null);
  const shownTab = tab ?? (ended ? "result" : "users");

  const lanes = useLaneData(run, loaded);
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
  const { turn } = lights;

  // A fast run may end between two pictures: no road user stays that has arrived.
  const cleared = mode === "live" && ended && info.progress?.running === 0;
  useEffect(() => {
    if (cleared) clear();
  }, [cleared, clear]);
  const { replay, seek } = player;
  useEffect(() => {
    if (!replay) return;
    if (linked.time !== undefined) seek(linked.time);
  }, [replay, seek, linked]);
  useEffect(() => {
    if (replay) keep({ time: player.time });
  }, [replay, player.time]);
  const known = player.replay?.crowd ?? crowd;
  const extent = useMemo(() => player.replay?.extent(), [player.replay]);
  // The recording says where its story was.
  const bounds = extent ? around(extent, STORY_MARGIN) : player.loading ? null : ground.bounds;
  const categories = useMemo(
    () => new Map<string, Category>(known?.all().map((one) => [one.id, one.category]) ?? []),
    [known],
  );
  const kinds = useMemo(
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
  const live = mode === "live";
  const at = mode === "replay" ? player.time : now.time;
  const time = live && ended ? Infinity : at;
  // A turn has states that the time does not tell.
  const heads = useMemo(() => (turn < 0 ? [] : drawn(time)), [drawn, time, turn]);
  const marks = useMemo(() => (fit ? countMarks(fit) : marksAt(incidents, time)), [incidents, fit, time]);
  const { occupied } = lights;
  const second = mode === "replay" ? Math.floor(time) : 0;
  const scene = useMemo(() => {
    if (!program) return ground.scene;
    const on = mode === "live" ? occupied : seenInLog(program.detectors, second)?.on;
    return { ...ground.scene, detectors: sceneDetectors(program, on) };
  }, [ground.scene, program, mode, occupied, second]);
  const pick = (view: number, spot: Pointed): void => {
    const user = picture.near(spot);
    const light = user === null ? lights.heads?.junctionAt(spot) : null;
    if (light) {
      setJunction(light);
      setTab("lights");
    } else follow(view, user);
  };

  const jump = (to: number): void => {
    player.pause();
    player.seek(to);
  };
  const place = (x: number, y: number): void => {
    follow(used.id, null);
    handleOf(used.id).current?.centre(x, y);
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
            <div className="run-views">
              {sights.map((sight, n) => (
                <RunMap
                  key={sight.id}
                  scenario={scenario}
                  run={run}
                  info={n === 0 ? info : null}
                  lost={lost && n === 0}
                  live={live}
                  drawing={drawing}
                  map={info.map ?? undefined}
                  loaded={loaded}
                  scene={scene}
                  heads={heads}
                  marks={marks}
                  bounds={bounds}
                  sight={sight}
                  views={views}
                  picture={picture}
                  player={player}
                  replayable={replayable}
                  lanes={lanes}
                  limitOf={limitOf}
                  crowd={known}
                  planned={crowd !== null}
                  categories={categories}
                  lights={lights.known && (map?.lights.length ?? 0) > 0}
                  kinds={kinds}
                  onPick={(spot) => pick(sight.id, spot)}
                />
              ))}
            </div>
          ) : (
            <div className="empty">
              <Loader aria-label={t`Loading the map`} />
            </div>
          )}
        </div>
        <RunSide
          scenario={scenario}
          run={run}
          info={info}
          live={live}
          ended={ended}
          complete={complete}
          replayable={replayable}
          tab={shownTab}
          onTab={setTab}
          latest={latest}
          followed={used.followed}
          onFollow={(user) => follow(used.id, user)}
          view={views.list.length > 1 ? viewName(views.list.indexOf(used) + 1, views.list.length) : null}
          incidents={incidents}
          categories={categories}
          counts={content?.counts ?? 0}
          onFit={setFit}
          lights={lights}
          places={loaded?.graph.names ?? NO_NAMES}
          junction={shownJunction}
          onJunction={setJunction}
          loadProgram={loadProgram}
          onProgram={setProgram}
          queues={queues}
          time={at}
          onPlace={place}
          onJump={mode === "replay" ? jump : null}
          onBack={back}
          onResume={onResume}
        />
      </div>
      <RunBar
        end={longest}
        reached={reached}
        time={at}
        incidents={incidents}
        categories={categories}
        junction={shownJunction}
        history={history}
        plans={plans}
        ttc={ttc}
        spacing={player.replay?.spacing ?? 0.2}
        first={live && longest > 2 * STORY && known && known.all().length <= MOST_ACTORS ? STORY : null}
        onSeek={player.replay ? jump : null}
        onShow={({ x, y }) => {
          if (x !== undefined && y !== undefined) place(x, y);
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
