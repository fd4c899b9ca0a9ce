import { Button, Group, Select, Text } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import { useEffect, useState } from "react";

import { type Demand, demand as api, type Entry, type VehicleInput } from "../api/demand";
import type { Edit, FieldsOf } from "../api/types";
import type { PlaceNames } from "../map/placeNames";
import { reasonOf } from "../ui/reason";
import { Committed } from "./Committed";
import { ProfileChoice, type Profiles } from "./DayProfiles";
import { freeName } from "./demand";
import { ArrivalsChoice, MixFold, PartCard, WindowFields } from "./DemandParts";
import type { EditorStore } from "./store";

/** Vehicles an hour and lane that a new input begins with. */
const PER_LANE = 600;

/** Vehicles that drive in at the boundary of the region: how many, when, and their mix. */
export function InputForm({
  input,
  places,
  profiles,
  onEdit,
  onShow,
  onRemove,
}: {
  input: VehicleInput;
  places: PlaceNames;
  profiles: Profiles;
  onEdit: (edit: Edit) => void;
  onShow: (segments: readonly string[]) => void;
  onRemove: () => void;
}) {
  const change = (fields: FieldsOf<"set_input", "inflow">): void =>
    onEdit({ kind: "set_input", inflow: input.id, ...fields });
  const lanes = input.lanes.length
    ? t` on ${plural(input.lanes.length, { one: "# lane", other: "# lanes" })}`
    : "";
  const note = t`on ${places.road(input.segment)}${input.direction ? `, ${input.direction}` : ""}${lanes}`;
  return (
    <PartCard name={input.id} what={t`Vehicle input`} note={note} onRemove={onRemove}>
      {input.per_hour === null ? (
        <Text size="sm">
          <Trans>
            <Plural
              value={Math.round(input.volumes.reduce((sum, one) => sum + one, 0))}
              one="# vehicle"
              other="# vehicles"
            />{" "}
            in <Plural value={input.volumes.length} one="# slice" other="# slices" /> of {input.interval / 60}{" "}
            min
          </Trans>
        </Text>
      ) : (
        <>
          <Committed
            label={t`Vehicles per hour`}
            suffix=""
            min={1}
            max={40_000}
            digits={0}
            value={input.per_hour}
            onCommit={(per_hour) => {
              if (per_hour !== null) change({ per_hour });
            }}
          />
          <WindowFields begin={input.begin} end={input.end} onChange={change} />
          <ProfileChoice
            value={input.profile}
            profiles={profiles}
            onChange={(profile) => change({ profile })}
          />
          <Committed
            label={t`Peak hour factor`}
            suffix=""
            min={0.25}
            max={1}
            step={0.01}
            digits={2}
            placeholder={t`none`}
            value={input.peak_hour_factor ?? ""}
            onCommit={(peak_hour_factor) => change({ peak_hour_factor })}
          />
        </>
      )}
      <ArrivalsChoice value={input.arrivals} onChange={(arrivals) => change({ arrivals })} />
      <MixFold mix={input.mix} onChange={(mix) => change({ mix })} />
      <Group>
        <Button size="compact-sm" variant="default" onClick={() => onShow([input.segment])}>
          <Trans>Show where</Trans>
        </Button>
      </Group>
    </PartCard>
  );
}

/** Chooses the place of a new input among those where lanes lead into the region. */
export function NewInput({
  store,
  places,
  demand,
  onEdit,
  onShow,
}: {
  store: EditorStore;
  places: PlaceNames;
  demand: Demand;
  onEdit: (edit: Edit) => void;
  onShow: (segments: readonly string[]) => void;
}) {
  const { name } = store();
  const [entries, setEntries] = useState<readonly Entry[] | null>(null);
  const [reason, setReason] = useState<string | null>(null);
  const [chosen, setChosen] = useState<string | null>(null);
  useEffect(() => {
    api.entries(name).then(setEntries, (error: unknown) => setReason(reasonOf(error)));
  }, [name]);
  if (reason) return <Text size="sm">{reason}</Text>;
  if (!entries)
    return (
      <Text size="sm">
        <Trans>Looking for lanes that lead into the region ...</Trans>
      </Text>
    );
  if (!entries.length)
    return (
      <Text size="sm">
        <Trans>No lane leads into the region: it has no open end.</Trans>
      </Text>
    );
  const both = (segment: string): boolean => entries.filter((one) => one.segment === segment).length > 1;
  const entry = entries.find((one) => keyOf(one) === chosen);
  return (
    <div className="fold">
      <Select
        label={t`Where they drive in`}
        placeholder={t`Choose a segment`}
        data={entries.map((one) => ({
          value: keyOf(one),
          label:
            `${places.placeWithId(one.segment)}, ${plural(one.lanes.length, { one: "# lane", other: "# lanes" })}` +
            (both(one.segment) ? `, ${one.direction}` : ""),
        }))}
        value={chosen}
        searchable
        onChange={(key) => {
          setChosen(key);
          const found = entries.find((one) => keyOf(one) === key);
          if (found) onShow([found.segment]);
        }}
      />
      <Button
        mt={6}
        disabled={!entry}
        onClick={() => {
          if (entry)
            onEdit({
              kind: "set_input",
              inflow: freeName(demand, "input"),
              segment: entry.segment,
              direction: both(entry.segment) ? entry.direction : null,
              per_hour: PER_LANE * entry.lanes.length,
            });
        }}
      >
        <Trans>Add</Trans>
      </Button>
    </div>
  );
}

const keyOf = ({ segment, direction }: Entry): string => `${segment} ${direction}`;
