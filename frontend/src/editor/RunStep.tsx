import { Button, NumberInput, SegmentedControl, Select, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { localized } from "../language/localized";
import { models } from "../api/models";
import type { Edit, ScenarioDocument } from "../api/types";
import type { PlaceNames } from "../map/placeNames";
import { CarlaChoice } from "../carla/CarlaChoice";
import { driverWords } from "../ui/drivers";
import { IconPlay } from "../ui/icons";
import { Duration } from "./Duration";
import { Forecast } from "./Forecast";
import { MeasureList } from "./MeasureList";
import { ModelChoice } from "./ModelChoice";
import type { RunChoices } from "./runChoices";
import { SimulatorChoice } from "./SimulatorChoice";

/** Seconds after the end of the story at which the run of a scene ends, as on the server. */
const AFTER_STORY = 10;
const PACES = localized(() => [
  { value: "real", label: t`Real time` },
  { value: "fast", label: t`As fast as possible` },
]);
const RECORDINGS = localized(() => [
  { value: "step", label: t`Every step` },
  { value: "1", label: t`Every second` },
  { value: "10", label: t`Every 10 seconds` },
  { value: "none", label: t`Nothing` },
]);

/** When the run of a scenario with rules ends: some seconds after its story, or with its duration. */
function StoryEnd({ document, onEdit }: { document: ScenarioDocument; onEdit: (edit: Edit) => void }) {
  if (document.rules.length === 0) return null;
  const { after_story: wanted } = document.simulation;
  const after = (seconds: number): string => t`${seconds} s after the end of the story`;
  const whole = t`after its duration`;
  const scene = isScene(document);
  const choices: [string, string][] = scene
    ? [
        ["auto", after(AFTER_STORY)],
        ["never", whole],
      ]
    : [
        ["auto", whole],
        [String(AFTER_STORY), after(AFTER_STORY)],
      ];
  const known = choices.some(([value]) => value === String(wanted));
  if (!known) choices.push([String(wanted), wanted === "never" ? whole : after(Number(wanted))]);
  return (
    <Select
      label={t`The run ends`}
      description={t`the story has ended when no rule can fire any more`}
      inputWrapperOrder={["label", "input", "description"]}
      data={choices.map(([value, label]) => ({ value, label }))}
      value={String(wanted)}
      allowDeselect={false}
      onChange={(value) => {
        if (value === null || value === String(wanted)) return;
        const next = value === "auto" || value === "never" ? value : Number(value);
        onEdit({ kind: "set_simulation", after_story: next });
      }}
    />
  );
}

/** Whether a scenario has rules and no traffic, as on the server. */
const isScene = ({ flows, demand, transit, sumo }: ScenarioDocument): boolean =>
  flows.length === 0 &&
  [demand.inputs, demand.matrices, demand.counts, demand.background].every((parts) => parts.length === 0) &&
  transit.lines.length === 0 &&
  sumo === null;

/** What is started, its duration, what is recorded, and how fast it begins. */
export function RunStep({
  name,
  version,
  document,
  places,
  choices,
  blocked,
  empty,
  busy,
  onEdit,
  onRun,
}: {
  name: string;
  version: number;
  document: ScenarioDocument;
  places: PlaceNames;
  choices: RunChoices;
  blocked: boolean;
  empty: boolean;
  busy: boolean;
  onEdit: (edit: Edit) => void;
  onRun: () => void;
}) {
  const {
    simulation: { duration },
    seed,
    measures,
  } = document;
  const { inCarla, recording, driver, simulator, long, pace, wish, choose } = choices;
  return (
    <>
      <Duration
        key={duration}
        label={t`Duration`}
        seconds={duration}
        onCommit={(value) => onEdit({ kind: "set_simulation", duration: value })}
      />
      <StoryEnd document={document} onEdit={onEdit} />
      {long && (
        <Text size="xs" c="dimmed">
          <Trans>
            A run of more than an hour is saved after each hour: if it is interrupted, it can be resumed from
            the last full hour.
          </Trans>
        </Text>
      )}
      <NumberInput
        label={t`Random seed`}
        description={t`same seed, same traffic`}
        inputWrapperOrder={["label", "input", "description"]}
        min={0}
        allowDecimal={false}
        defaultValue={seed}
        key={seed}
        onBlur={(event) => {
          const value = Number.parseInt(event.currentTarget.value, 10);
          if (value >= 0 && value !== seed) onEdit({ kind: "set_seed", seed: value });
        }}
      />
      <Select
        label={t`Record trajectories`}
        description={t`for replay, charts and counts`}
        inputWrapperOrder={["label", "input", "description"]}
        data={RECORDINGS()}
        value={inCarla && !simulator ? "step" : recording}
        disabled={inCarla && !simulator}
        allowDeselect={false}
        onChange={(value) => choose({ recording: value ?? "step" })}
      />
      <MeasureList measures={measures} places={places} />
      <SimulatorChoice
        scenario={name}
        version={version}
        chosen={simulator}
        onChange={(next) => choose({ simulator: next })}
      />
      {!simulator && (
        <>
          <ModelChoice
            offered={models.behaviours}
            label={t`Vehicles and lights controlled by`}
            none={t`SUMO’s drivers`}
            words={driverWords}
            unusable={t`This behaviour model cannot be used`}
            chosen={driver}
            onChange={(next) => choose({ driver: next })}
          />
          <div>
            <Text size="sm" fw={500}>
              <Trans>Speed at the start</Trans>
            </Text>
            <SegmentedControl
              fullWidth
              data={PACES()}
              value={pace}
              aria-label={t`Speed at the start`}
              onChange={(next) => choose({ pace: next })}
            />
          </div>
          <CarlaChoice chosen={inCarla} onChoose={(next) => choose({ inCarla: next })} />
        </>
      )}
      {empty && (
        <Text size="sm">
          <Trans>There are no road users yet. Place some in “Road users”, or add traffic in “Demand”.</Trans>
        </Text>
      )}
      {blocked && (
        <Text size="sm" c="red">
          <Trans>Solve the problems listed below first.</Trans>
        </Text>
      )}
      {!blocked && !empty && !simulator && <Forecast wish={wish} version={version} />}
      <Button size="md" leftSection={<IconPlay />} loading={busy} disabled={blocked || empty} onClick={onRun}>
        <Trans context="button">Run</Trans>
      </Button>
    </>
  );
}
