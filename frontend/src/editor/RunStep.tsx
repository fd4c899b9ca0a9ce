import { Button, NumberInput, SegmentedControl, Select, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { localized } from "../language/localized";
import { type Chosen, models } from "../api/models";
import type { RunWish } from "../api/runs";
import type { Edit, ScenarioDocument } from "../api/types";
import { CarlaChoice } from "../carla/CarlaChoice";
import { driverWords } from "../ui/drivers";
import { IconPlay } from "../ui/icons";
import { Duration } from "./Duration";
import { Forecast } from "./Forecast";
import { MeasureList } from "./MeasureList";
import { ModelChoice } from "./ModelChoice";
import { SimulatorChoice } from "./SimulatorChoice";

const CONTROLS = localized(() => [
  { value: "fixed", label: t`Fixed-time` },
  { value: "actuated", label: t`Actuated` },
]);
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
/** Longer runs are made in slices, and not watched in real time. */
const LONG = 3600;

/** Duration, signal control, what is recorded, and the start of a run. */
export function RunStep({
  name,
  version,
  document,
  lights,
  blocked,
  empty,
  busy,
  onEdit,
  onRun,
  onLights,
}: {
  name: string;
  version: number;
  document: ScenarioDocument;
  lights: boolean;
  blocked: boolean;
  empty: boolean;
  busy: boolean;
  onEdit: (edit: Edit) => void;
  onRun: (wish: RunWish) => void;
  /** Shows the programs of the traffic lights. */
  onLights: () => void;
}) {
  const {
    simulation: { duration },
    seed,
    signals: { control },
    measures,
  } = document;
  const [inCarla, setInCarla] = useState(false);
  const [recording, setRecording] = useState("step");
  const [pace, setPace] = useState<string | null>(null);
  const [driver, setDriver] = useState<Chosen | null>(null);
  const [simulator, setSimulator] = useState<Chosen | null>(null);
  const long = duration > LONG;
  const chosenPace = pace ?? (long ? "fast" : "real");
  const every = inCarla || recording === "step" || recording === "none" ? null : Number(recording);
  const wish: RunWish = {
    scenario: name,
    speed: chosenPace === "fast" ? null : 1,
    carla: inCarla,
    trajectories: inCarla || recording !== "none",
    every,
    ...(driver && { behaviour: driver }),
  };
  const elsewhere: RunWish | null = simulator && {
    scenario: name,
    trajectories: recording !== "none",
    every: recording === "step" || recording === "none" ? null : Number(recording),
    simulator,
  };
  return (
    <>
      <Duration
        key={duration}
        label={t`Duration`}
        seconds={duration}
        onCommit={(value) => onEdit({ kind: "set_simulation", duration: value })}
      />
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
        onChange={(value) => setRecording(value ?? "step")}
      />
      {lights && (
        <div>
          <Text size="sm" fw={500}>
            <Trans>Signal control</Trans>
          </Text>
          <SegmentedControl
            fullWidth
            data={CONTROLS()}
            value={control}
            aria-label={t`Signal control`}
            onChange={(value) =>
              onEdit({ kind: "set_signal_control", control: value === "actuated" ? value : "fixed" })
            }
          />
          <Text size="xs" c="dimmed" mt={4}>
            {control === "fixed"
              ? t`Every signal keeps its times.`
              : t`A green is extended while vehicles arrive.`}
          </Text>
          <Button size="compact-sm" variant="default" mt={6} onClick={onLights}>
            <Trans>Show the signal programs</Trans>
          </Button>
        </div>
      )}
      <MeasureList measures={measures} />
      <SimulatorChoice scenario={name} version={version} chosen={simulator} onChange={setSimulator} />
      {!simulator && (
        <>
          <ModelChoice
            offered={models.behaviours}
            label={t`Vehicles driven by`}
            none={t`SUMO’s drivers`}
            words={driverWords}
            unusable={t`This behaviour model cannot be used`}
            chosen={driver}
            onChange={setDriver}
          />
          <div>
            <Text size="sm" fw={500}>
              <Trans>Speed at the start</Trans>
            </Text>
            <SegmentedControl
              fullWidth
              data={PACES()}
              value={chosenPace}
              aria-label={t`Speed at the start`}
              onChange={setPace}
            />
          </div>
          <CarlaChoice chosen={inCarla} onChoose={setInCarla} />
        </>
      )}
      {empty && (
        <Text size="sm">
          <Trans>There are no road users yet. Place some in “Road users”, or add traffic in “Traffic”.</Trans>
        </Text>
      )}
      {blocked && (
        <Text size="sm" c="red">
          <Trans>Solve the problems listed below first.</Trans>
        </Text>
      )}
      {!blocked && !empty && !simulator && <Forecast wish={wish} version={version} />}
      <Button
        size="md"
        leftSection={<IconPlay />}
        loading={busy}
        disabled={blocked || empty}
        onClick={() => onRun(elsewhere ?? wish)}
      >
        <Trans context="button">Run</Trans>
      </Button>
    </>
  );
}
