import { Button, Group, SegmentedControl, Select, Text } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import type { Edit, ScenarioDocument } from "../api/types";
import { localized } from "../language/localized";
import type { PlaceNames } from "../map/placeNames";
import { byNameOrId, junctionChoices } from "../ui/choices";

/** Nothing is said in the scenario. */
const UNSAID = "unsaid";
const CONTROLS = localized(() => [
  { value: UNSAID, label: t`Default` },
  { value: "fixed", label: t`Fixed-time` },
  { value: "extended", label: t`Extended` },
  { value: "actuated", label: t`Actuated` },
]);
const CONTROL_NOTES = localized(() => ({
  [UNSAID]: t`Greens of the map last longer while vehicles follow each other. Lights timed here, or by another network, keep their times.`,
  fixed: t`Every signal keeps its times.`,
  extended: t`A green lasts as long as planned, and longer while vehicles follow each other.`,
  actuated: t`A green is extended while vehicles arrive.`,
}));
/** So many junctions are buttons; more are a list that can be searched. */
const FEW = 12;

/** Of the step, in a line. */
export const lightsNote = (junctions: readonly string[]): string =>
  junctions.length === 0
    ? t`None on this map`
    : plural(junctions.length, { one: "# junction", other: "# junctions" });

/** The traffic lights of the map: how all are controlled, and the program of each junction. */
export function LightsStep({
  junctions,
  places,
  shown,
  control,
  onEdit,
  onShow,
}: {
  junctions: readonly string[];
  places: PlaceNames;
  /** The junction whose program is open. */
  shown: string | null;
  control: ScenarioDocument["signals"]["control"];
  onEdit: (edit: Edit) => void;
  onShow: (junction: string) => void;
}) {
  if (junctions.length === 0)
    return (
      <Text size="sm">
        <Trans>This map has no traffic lights.</Trans>
      </Text>
    );
  const choices = junctionChoices(places, junctions);
  return (
    <>
      <Text size="sm">
        <Trans>Click a junction on the map to see its signal program and change it.</Trans>
      </Text>
      {junctions.length > FEW ? (
        <Select
          label={t`Junction`}
          placeholder={t`Choose a junction`}
          data={choices}
          value={shown}
          searchable
          filter={byNameOrId}
          onChange={(junction) => {
            if (junction) onShow(junction);
          }}
        />
      ) : (
        <Group gap={6} role="group" aria-label={t`Junctions with a traffic light`}>
          {choices.map(({ value, label }) => (
            <Button
              key={value}
              size="compact-sm"
              className="wrapping"
              variant={value === shown ? "filled" : "default"}
              aria-pressed={value === shown}
              onClick={() => onShow(value)}
            >
              {label}
            </Button>
          ))}
        </Group>
      )}
      <div>
        <Text size="sm" fw={500}>
          <Trans>Signal control</Trans>
        </Text>
        <SegmentedControl
          fullWidth
          orientation="vertical"
          data={CONTROLS()}
          value={control ?? UNSAID}
          aria-label={t`Signal control`}
          onChange={(value) =>
            onEdit({
              kind: "set_signal_control",
              control: value === "fixed" || value === "actuated" || value === "extended" ? value : null,
            })
          }
        />
        <Text size="xs" c="dimmed" mt={4}>
          {CONTROL_NOTES()[control ?? UNSAID]}
        </Text>
      </div>
    </>
  );
}
