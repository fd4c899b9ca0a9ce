import { Alert, Button, NumberInput, SegmentedControl, Text } from "@mantine/core";
import { useState } from "react";

import { demand } from "../api/demand";
import { tell } from "../ui/notices";
import { count } from "../ui/words";
import type { EditorStore } from "./store";

const DAYS = [{ value: "weekday", label: "Weekday" }, { value: "weekend", label: "Weekend" }];

/** Makes a day of traffic on the whole map. */
export function WholeDay({ store, onDone }: { store: EditorStore; onDone: () => void }) {
  const { name, take } = store();
  const [day, setDay] = useState<"weekday" | "weekend">("weekday");
  const [trips, setTrips] = useState(51_000);
  const [busy, setBusy] = useState(false);
  const [failure, setFailure] = useState<string | null>(null);
  const make = (): void => {
    setBusy(true);
    setFailure(null);
    take(async (version) => {
      const made = await demand.day(name, version, day, trips);
      const load = Math.round((100 * made.volume) / made.capacity);
      tell(`${count(Math.round(made.trips), "trip")}, ${Math.round(made.peak_trips).toLocaleString("en")} in the busiest hour. ` +
        `The busiest way into a junction then gets ${load} % of what it carries.` +
        (made.trips < trips ? " More trips would have been too many for the junctions." : ""));
      return made.scenario;
    }).then(onDone, (error: unknown) => setFailure((error as Error).message)).finally(() => setBusy(false));
  };
  return (
    <div className="fold">
      <Text size="sm">24 hours from midnight on: trips from anywhere to anywhere, fewer past busy junctions. The region becomes the whole map. Undo takes it back.</Text>
      <SegmentedControl fullWidth data={DAYS} value={day} aria-label="Kind of day" onChange={(value) => setDay(value as "weekday" | "weekend")} />
      <NumberInput label="Trips of the day, at most" min={1} max={1e6} step={1000} thousandSeparator="," allowDecimal={false} value={trips}
        onChange={(value) => setTrips(Number(value) || 1)} />
      {failure && <Alert color="red" title="This day cannot be made">{failure}</Alert>}
      <Button variant="light" loading={busy} onClick={make}>Make the day</Button>
    </div>
  );
}
