import { Button, Group, NumberInput, SegmentedControl, Text } from "@mantine/core";
import { useState } from "react";

import type { Edit, ScenarioDocument } from "../api/types";
import { CarlaChoice } from "../carla/CarlaChoice";
import { IconPlay } from "../ui/icons";

const CONTROLS = [{ value: "fixed", label: "By the clock" }, { value: "actuated", label: "By the traffic" }];

/** How long it lasts, how the lights work, and the start. */
export function RunStep({ document, lights, blocked, empty, busy, onEdit, onRun }: {
  document: ScenarioDocument; lights: boolean; blocked: boolean; empty: boolean; busy: boolean;
  onEdit: (edit: Edit) => void; onRun: (inCarla: boolean) => void;
}) {
  const [inCarla, setInCarla] = useState(false);
  const { simulation: { duration }, seed, signals: { control } } = document;
  return (
    <>
      <Group grow align="flex-start">
        <NumberInput label="Lasts" suffix=" s" min={1} max={1e6} defaultValue={duration}
          onBlur={(event) => { const value = Number.parseFloat(event.currentTarget.value); if (value > 0 && value !== duration) onEdit({ kind: "set_simulation", duration: value }); }} />
        <NumberInput label="Chance number" description="same number, same traffic" inputWrapperOrder={["label", "input", "description"]} min={0} allowDecimal={false} defaultValue={seed}
          onBlur={(event) => { const value = Number.parseInt(event.currentTarget.value, 10); if (value >= 0 && value !== seed) onEdit({ kind: "set_seed", seed: value }); }} />
      </Group>
      {lights && (
        <div>
          <Text size="sm" fw={500}>Traffic lights change</Text>
          <SegmentedControl fullWidth data={CONTROLS} value={control} aria-label="Traffic lights change"
            onChange={(value) => onEdit({ kind: "set_signal_control", control: value })} />
          <Text size="xs" c="dimmed" mt={4}>{control === "fixed"
            ? "Every light keeps its own times." : "A green lasts longer while vehicles still come."}</Text>
        </div>
      )}
      <CarlaChoice chosen={inCarla} onChoose={setInCarla} />
      {empty && <Text size="sm">Nobody is in the scenario yet. Place somebody in “Road users” first.</Text>}
      {blocked && <Text size="sm" c="red">Solve the problems listed below first.</Text>}
      <Button size="md" leftSection={<IconPlay />} loading={busy} disabled={blocked || empty} onClick={() => onRun(inCarla)}>Run</Button>
    </>
  );
}
