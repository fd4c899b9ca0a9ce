import { i18n } from "@lingui/core";
import { Alert, Button, Checkbox, Group, NumberInput, SegmentedControl, Text } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { decimalSign } from "../language/numbers";
import { localized } from "../language/localized";
import { api } from "../api/client";
import { demand } from "../api/demand";
import { isKey } from "../lists";
import { tell } from "../ui/notices";
import { reasonOf } from "../ui/reason";
import { sentence } from "../ui/words";
import type { EditorStore } from "./store";
import { served } from "../language/served";

const DAYS = localized(() => ({ weekday: t`Weekday`, weekend: t`Weekend` }));

/** Generates a day of traffic on the whole map. */
export function WholeDay({ store, onDone }: { store: EditorStore; onDone: () => void }) {
  const { name, take } = store();
  const [day, setDay] = useState<keyof ReturnType<typeof DAYS>>("weekday");
  const [trips, setTrips] = useState(51_000);
  const [trial, setTrial] = useState(true);
  const [busy, setBusy] = useState<{ job?: string; step: string } | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  const make = (): void => {
    setBusy({ step: t`Starting` });
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
      const peak = Math.round(made.peak_trips).toLocaleString(i18n.locale);
      tell(
        [
          t`${plural(Math.round(made.trips), { one: "# trip", other: "# trips" })}, ${peak} in the peak hour.`,
          t`The busiest approach of a junction then reaches ${load} % of its capacity.`,
          ...(made.trips < trips ? [t`More trips would have exceeded the capacity of the junctions.`] : []),
          ...(made.found === null ? [] : [`${served(made.found)}.`]),
        ].join(" "),
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
        <Trans>
          24 hours from midnight: trips with random starts and goals, fewer through busy junctions. The region
          becomes the whole map. Undo restores the scenario.
        </Trans>
      </Text>
      <SegmentedControl
        fullWidth
        data={Object.entries(DAYS()).map(([value, label]) => ({ value, label }))}
        value={day}
        aria-label={t`Kind of day`}
        onChange={(value) => {
          if (isKey(DAYS(), value)) setDay(value);
        }}
      />
      <NumberInput
        label={t`Trips per day, at most`}
        min={1}
        max={1e6}
        step={1000}
        thousandSeparator={decimalSign() === "," ? "." : ","}
        allowDecimal={false}
        value={trips}
        onChange={(value) => setTrips(Number(value) || 1)}
      />
      <Checkbox
        label={t`Try the busiest hour by runs`}
        description={t`Takes a minute or two; there are then as many trips as the network carries.`}
        checked={trial}
        onChange={(event) => setTrial(event.currentTarget.checked)}
      />
      {failure && (
        <Alert color="red" title={t`The day could not be generated`}>
          {failure}
        </Alert>
      )}
      <Button variant="light" loading={busy !== null} onClick={make}>
        <Trans>Generate the day</Trans>
      </Button>
      {busy && (
        <Group justify="space-between" wrap="nowrap" gap="xs">
          <Text size="sm" c="dimmed" role="status">
            {sentence(served(busy.step))}
          </Text>
          <Button
            size="compact-sm"
            variant="default"
            disabled={!busy.job}
            onClick={() => busy.job && void api.cancelJob(busy.job).catch(() => undefined)}
          >
            <Trans>Cancel</Trans>
          </Button>
        </Group>
      )}
    </div>
  );
}
