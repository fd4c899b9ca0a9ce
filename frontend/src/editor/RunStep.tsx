import { Button, NumberInput, SegmentedControl, Select, Text } from "@mantine/core";
import { useState } from "react";

import type { RunWish } from "../api/runs";
import type { Edit, ScenarioDocument } from "../api/types";
import { CarlaChoice } from "../carla/CarlaChoice";
import { IconPlay } from "../ui/icons";
import { Duration } from "./Duration";
import { Forecast } from "./Forecast";
import { MeasureList } from "./MeasureList";

const CONTROLS = [
  { value: "fixed", label: "Fixed-time" },
  { value: "actuated", label: "Actuated" },
];
const PACES = [
  { value: "real", label: "Real time" },
  { value: "fast", label: "As fast as possible" },
];
const RECORDINGS = [
  { value: "step", label: "Every step" },
  { value: "1", label: "Every second" },
  { value: "10", label: "Every 10 seconds" },
  { value: "none", label: "Nothing" },
];
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
  const long = duration > LONG;
  const chosenPace = pace ?? (long ? "fast" : "real");
  const every = inCarla || recording === "step" || recording === "none" ? null : Number(recording);
  const wish: RunWish = {
    scenario: name,
    speed: chosenPace === "fast" ? null : 1,
    carla: inCarla,
    trajectories: inCarla || recording !== "none",
    every,
  };
  return (
    <>
      <Duration
        key={duration}
        label="Duration"
        seconds={duration}
        onCommit={(value) => onEdit({ kind: "set_simulation", duration: value })}
      />
      {long && (
        <Text size="xs" c="dimmed">
          A run of more than an hour is saved after each hour: if it is interrupted, it can be resumed from
          the last full hour.
        </Text>
      )}
      <NumberInput
        label="Random seed"
        description="same seed, same traffic"
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
        label="Record trajectories"
        description="for replay, charts and counts"
        inputWrapperOrder={["label", "input", "description"]}
        data={RECORDINGS}
        value={inCarla ? "step" : recording}
        disabled={inCarla}
        allowDeselect={false}
        onChange={(value) => setRecording(value ?? "step")}
      />
      {lights && (
        <div>
          <Text size="sm" fw={500}>
            Signal control
          </Text>
          <SegmentedControl
            fullWidth
            data={CONTROLS}
            value={control}
            aria-label="Signal control"
            onChange={(value) =>
              onEdit({ kind: "set_signal_control", control: value === "actuated" ? value : "fixed" })
            }
          />
          <Text size="xs" c="dimmed" mt={4}>
            {control === "fixed"
              ? "Every signal keeps its times."
              : "A green is extended while vehicles arrive."}
          </Text>
          <Button size="compact-sm" variant="default" mt={6} onClick={onLights}>
            Show the signal programs
          </Button>
        </div>
      )}
      <MeasureList measures={measures} />
      <div>
        <Text size="sm" fw={500}>
          Speed at the start
        </Text>
        <SegmentedControl
          fullWidth
          data={PACES}
          value={chosenPace}
          aria-label="Speed at the start"
          onChange={setPace}
        />
      </div>
      <CarlaChoice chosen={inCarla} onChoose={setInCarla} />
      {empty && (
        <Text size="sm">
          There are no road users yet. Place some in “Road users”, or add traffic in “Traffic”.
        </Text>
      )}
      {blocked && (
        <Text size="sm" c="red">
          Solve the problems listed below first.
        </Text>
      )}
      {!blocked && !empty && <Forecast wish={wish} version={version} />}
      <Button
        size="md"
        leftSection={<IconPlay />}
        loading={busy}
        disabled={blocked || empty}
        onClick={() => onRun(wish)}
      >
        Run
      </Button>
    </>
  );
}
