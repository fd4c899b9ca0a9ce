import { Alert, Button, Checkbox, NumberInput, SegmentedControl, Text } from "@mantine/core";
import { useState } from "react";

import { demand } from "../api/demand";
import { isKey } from "../lists";
import { tell } from "../ui/notices";
import { reasonOf } from "../ui/reason";
import { count } from "../ui/words";
import type { EditorStore } from "./store";

const DAYS = { weekday: "Weekday", weekend: "Weekend" };

/** Generates a day of traffic on the whole map. */
export function WholeDay({ store, onDone }: { store: EditorStore; onDone: () => void }) {
  const { name, take } = store();
  const [day, setDay] = useState<keyof typeof DAYS>("weekday");
  const [trips, setTrips] = useState(51_000);
  const [trial, setTrial] = useState(true);
  const [busy, setBusy] = useState(false);
  const [failure, setFailure] = useState<string | null>(null);
  const make = (): void => {
    setBusy(true);
    setFailure(null);
    take(async (version) => {
      const made = await demand.day(name, version, { day, trips, trial });
      const load = Math.round((100 * made.volume) / made.capacity);
      const peak = Math.round(made.peak_trips).toLocaleString("en");
      tell(
        `${count(Math.round(made.trips), "trip")}, ${peak} in the peak hour. ` +
          `The busiest approach of a junction then reaches ${load} % of its capacity.` +
          (made.trips < trips ? " More trips would have exceeded the capacity of the junctions." : "") +
          (made.found === null ? "" : ` ${made.found}.`),
      );
      return made.scenario;
    })
      .then(onDone, (error: unknown) => setFailure(reasonOf(error)))
      .finally(() => setBusy(false));
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
      <Button variant="light" loading={busy} onClick={make}>
        Generate the day
      </Button>
    </div>
  );
}
