import { Alert, Button, Checkbox, Group, NumberInput, SegmentedControl, Text } from "@mantine/core";
import { useState } from "react";

import { api } from "../api/client";
import { demand } from "../api/demand";
import { isKey } from "../lists";
import { tell } from "../ui/notices";
import { reasonOf } from "../ui/reason";
import { count, sentence } from "../ui/words";
import type { EditorStore } from "./store";

const DAYS = { weekday: "Weekday", weekend: "Weekend" };

/** Generates a day of traffic on the whole map. */
export function WholeDay({ store, onDone }: { store: EditorStore; onDone: () => void }) {
  const { name, take } = store();
  const [day, setDay] = useState<keyof typeof DAYS>("weekday");
  const [trips, setTrips] = useState(51_000);
  const [trial, setTrial] = useState(true);
  const [busy, setBusy] = useState<{ job?: string; step: string } | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  const make = (): void => {
    setBusy({ step: "Starting" });
    let done = true;
    setFailure(null);
    take(async (version) => {
      const wish = { day, trips, trial };
      const made = await demand.day(name, version, wish, ({ id, step }) => setBusy({ job: id, step }));
      if (made === null) {
        done = false;
        return api.scenario(name);
      }
      const load = Math.round((100 * made.volume) / made.capacity);
      const peak = Math.round(made.peak_trips).toLocaleString("en");
      tell(
        `${count(Math.round(made.trips), "trip")}, ${peak} in the peak hour. ` +
          `The busiest approach of a junction then reaches ${load} % of its capacity.` +
          (made.trips < trips ? " More trips would have exceeded the capacity of the junctions." : "") +
          (made.found === null ? "" : ` ${made.found}.`),
      );
      return api.scenario(name);
    })
      .then(
        () => done && onDone(),
        (error: unknown) => setFailure(reasonOf(error)),
      )
      .finally(() => setBusy(null));
  };
  return (
    <div className="fold">
      <Text size="sm">
        24 hours from midnight: trips with random starts and goals, fewer through busy junctions. The region
        becomes the whole map. Undo restores the scenario.
      </Text>
      <SegmentedControl
        fullWidth
        data={Object.entries(DAYS).map(([value, label]) => ({ value, label }))}
        value={day}
        aria-label="Kind of day"
        onChange={(value) => {
          if (isKey(DAYS, value)) setDay(value);
        }}
      />
      <NumberInput
        label="Trips per day, at most"
        min={1}
        max={1e6}
        step={1000}
        thousandSeparator=","
        allowDecimal={false}
        value={trips}
        onChange={(value) => setTrips(Number(value) || 1)}
      />
      <Checkbox
        label="Try the busiest hour by runs"
        description="Takes a minute or two; there are then as many trips as the network carries."
        checked={trial}
        onChange={(event) => setTrial(event.currentTarget.checked)}
      />
      {failure && (
        <Alert color="red" title="The day could not be generated">
          {failure}
        </Alert>
      )}
      <Button variant="light" loading={busy !== null} onClick={make}>
        Generate the day
      </Button>
      {busy && (
        <Group justify="space-between" wrap="nowrap" gap="xs">
          <Text size="sm" c="dimmed" role="status">
            {sentence(busy.step)}
          </Text>
          <Button
            size="compact-sm"
            variant="default"
            disabled={!busy.job}
            onClick={() => busy.job && void api.cancelJob(busy.job).catch(() => undefined)}
          >
            Cancel
          </Button>
        </Group>
      )}
    </div>
  );
}
