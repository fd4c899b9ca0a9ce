import { i18n } from "@lingui/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { Tabs } from "@mantine/core";

import type { FitRow, Incident, RunInfo } from "../api/runs";
import type { LightProgram } from "../api/signals";
import type { Category } from "../api/types";
import { CameraPanel } from "../carla/CameraPanel";
import type { Queue } from "../signals/queues";
import { SignalPanel } from "../signals/SignalPanel";
import type { RunLights } from "../signals/useSignals";
import { go } from "../ui/address";
import { CountsFit } from "./CountsFit";
import { EarlierRuns } from "./EarlierRuns";
import { IncidentLog } from "./IncidentLog";
import { SafeSlices } from "./LongRun";
import { Plots } from "./Plots";
import { Result } from "./Result";
import { RoadUsers } from "./RoadUsers";
import type { PlaceNames } from "../map/placeNames";
import type { Picture } from "./usePicture";

interface Props {
  scenario: string;
  run: string;
  info: RunInfo;
  /** Whether the run is watched while it runs. */
  live: boolean;
  ended: boolean;
  /** Whether all that is known after the end is there, and whether there is a recording. */
  complete: boolean;
  replayable: boolean;
  tab: string;
  onTab: (tab: string | null) => void;
  latest: Picture["latest"];
  followed: string | null;
  onFollow: (user: string | null) => void;
  /** Which view of several it acts on; null of one alone. */
  view: string | null;
  incidents: readonly Incident[];
  categories: ReadonlyMap<string, Category>;
  /** How many files of counts the run can be compared with. */
  counts: number;
  onFit: (fit: readonly FitRow[] | null) => void;
  lights: RunLights;
  /** Names of the places of the map. */
  places: PlaceNames;
  junction: string | null;
  onJunction: (junction: string) => void;
  loadProgram: (junction: string) => Promise<LightProgram>;
  onProgram: (program: LightProgram | null) => void;
  queues: readonly Queue[] | null;
  /** Seconds. */
  time: number;
  /** Shows a place, metres, and no longer follows anybody. */
  onPlace: (x: number, y: number) => void;
  /** Goes to a moment, seconds; null while there is no recording. */
  onJump: ((time: number) => void) | null;
  onBack: () => void;
  onResume: () => void;
}

/** What is said about a run beside its map, in tabs. */
export function RunSide({
  scenario,
  run,
  info,
  live,
  ended,
  complete,
  replayable,
  tab,
  onTab,
  latest,
  followed,
  onFollow,
  view,
  incidents,
  categories,
  counts,
  onFit,
  lights,
  places,
  junction,
  onJunction,
  loadProgram,
  onProgram,
  queues,
  time,
  onPlace,
  onJump,
  onBack,
  onResume,
}: Props) {
  return (
    <aside className="run-side" aria-label={t`About the run`}>
      {info.carla && live && <CameraPanel run={run} over={ended} />}
      <Tabs className="run-tabs" value={tab} onChange={onTab} keepMounted={false}>
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
          {junction && (
            <Tabs.Tab value="lights">
              <Trans>Lights</Trans>
            </Tabs.Tab>
          )}
          <Tabs.Tab value="runs">
            <Trans>Runs</Trans>
          </Tabs.Tab>
        </Tabs.List>
        <Tabs.Panel value="result" className="run-panel">
          <Result info={info} scenario={scenario} onBack={onBack} onResume={onResume} onShow={onJump} />
        </Tabs.Panel>
        <Tabs.Panel value="charts" className="run-panel">
          <Plots run={run} />
        </Tabs.Panel>
        <Tabs.Panel value="counts" className="run-panel">
          <CountsFit run={run} places={places} onFit={onFit} onShow={onPlace} />
        </Tabs.Panel>
        <Tabs.Panel value="users" className="run-panel">
          {!ended && <SafeSlices info={info} />}
          <RoadUsers
            latest={latest}
            followed={followed}
            onFollow={onFollow}
            view={view}
            wanted={tab === "users"}
          />
        </Tabs.Panel>
        <Tabs.Panel value="incidents" className="run-panel">
          <IncidentLog
            incidents={incidents}
            categories={categories}
            over={ended}
            onShow={({ x, y, time: at }) => {
              onJump?.(at);
              if (x !== undefined && y !== undefined) onPlace(x, y);
            }}
          />
        </Tabs.Panel>
        {junction && lights.heads && (
          <Tabs.Panel value="lights" className="run-panel">
            <SignalPanel
              junctions={lights.heads.junctions}
              junction={junction}
              places={places}
              onJunction={(next) => {
                onJunction(next);
                const middle = lights.heads?.middle(next);
                if (middle) onPlace(middle.x, middle.y);
              }}
              load={loadProgram}
              now={lights.now(junction, time)}
              occupied={live && !complete ? lights.occupied : null}
              queues={queues}
              onShown={onProgram}
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
  );
}
