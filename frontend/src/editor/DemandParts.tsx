import { ActionIcon, Button, Collapse, Group, Select, Text } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type ReactNode, useState } from "react";

import type { Arrivals, Counts, Matrix, Mix, Zone } from "../api/demand";
import type { Edit, FieldsOf } from "../api/types";
import { IconTrash } from "../ui/icons";
import { hasClock, span } from "../language/moments";
import { ProfileChart, ProfileChoice, type Profiles, profileWord } from "./DayProfiles";
import { mixWords, timeOfDay, tripsOf } from "./demand";
import { MixForm } from "./MixForm";
import { MomentField } from "./MomentField";

/** One part of the traffic, with its name and a button to remove it. */
export function PartCard({
  name,
  what,
  note,
  onRemove,
  children,
}: {
  name: string;
  what: string;
  note?: string;
  onRemove: () => void;
  children?: ReactNode;
}) {
  return (
    <section className="fold" aria-label={`${what} ${name}`}>
      <Group justify="space-between" wrap="nowrap" gap={8}>
        <div>
          <Text fw={600} size="sm">
            {what}
          </Text>
          <Text size="xs" c="dimmed" style={{ overflowWrap: "anywhere" }}>
            {note ? `${name}: ${note}` : name}
          </Text>
        </div>
        <ActionIcon variant="subtle" color="gray" aria-label={t`Remove ${name}`} onClick={onRemove}>
          <IconTrash />
        </ActionIcon>
      </Group>
      {children}
    </section>
  );
}

/** From when until when a part of the scenario is there. */
export function WindowFields({
  begin,
  end,
  onChange,
}: {
  begin: number;
  end: number | null;
  onChange: (fields: { begin?: number; end?: number | null }) => void;
}) {
  return (
    <Group grow align="flex-start">
      <MomentField
        label={t`From`}
        unit="min"
        step={60}
        value={begin}
        onCommit={(value) => onChange({ begin: value ?? 0 })}
      />
      <MomentField
        label={t`Until`}
        unit="min"
        step={60}
        placeholder={t`the end`}
        value={end}
        onCommit={(value) => onChange({ end: value })}
      />
    </Group>
  );
}

/** Whether the numbers are means of random arrivals, or as many come as are said. */
export function ArrivalsChoice({
  value,
  onChange,
}: {
  value: Arrivals;
  onChange: (arrivals: Arrivals) => void;
}) {
  return (
    <Select
      label={t`Arrivals`}
      data={[
        { value: "random", label: t`at random (Poisson)` },
        { value: "even", label: t`as many as said, with every seed` },
      ]}
      value={value}
      allowDeselect={false}
      onChange={(chosen) => onChange(chosen === "even" ? "even" : "random")}
    />
  );
}

/** The mix in a line; the shares open on demand. */
export function MixFold({
  mix,
  pedestrians,
  onChange,
}: {
  mix: Mix;
  pedestrians?: boolean;
  onChange: (mix: Mix) => void;
}) {
  const [open, setOpen] = useState(false);
  return (
    <div>
      <Text size="sm">{mixWords(mix)}</Text>
      <Button variant="subtle" size="compact-sm" px={0} aria-expanded={open} onClick={() => setOpen(!open)}>
        {open ? t`Hide the mix` : t`Change the mix`}
      </Button>
      <Collapse in={open}>
        {open && <MixForm mix={mix} pedestrians={pedestrians} onChange={onChange} />}
      </Collapse>
    </div>
  );
}

export function MatrixForm({
  matrix,
  profiles,
  onEdit,
  onRemove,
}: {
  matrix: Matrix;
  profiles: Profiles;
  onEdit: (edit: Edit) => void;
  onRemove: () => void;
}) {
  const change = (fields: FieldsOf<"set_matrix", "matrix">): void =>
    onEdit({ kind: "set_matrix", matrix: matrix.id, ...fields });
  const when =
    matrix.end === null
      ? t`until the end of the run`
      : hasClock()
        ? span(matrix.begin, matrix.end)
        : t`${span(matrix.begin, matrix.end)} of the run`;
  const note = t`${plural(Math.round(tripsOf(matrix)), { one: "# trip", other: "# trips" })} in ${plural(matrix.trips.length, { one: "# row", other: "# rows" })}, ${when}`;
  return (
    <PartCard name={matrix.id} what={t`Trips between zones`} note={note} onRemove={onRemove}>
      <WindowFields begin={matrix.begin} end={matrix.end} onChange={change} />
      <ProfileChoice value={matrix.profile} profiles={profiles} onChange={(profile) => change({ profile })} />
      <ArrivalsChoice value={matrix.arrivals} onChange={(arrivals) => change({ arrivals })} />
      <MixFold mix={matrix.mix} pedestrians onChange={(mix) => change({ mix })} />
    </PartCard>
  );
}

export function CountsList({
  counts,
  onEdit,
  onShow,
  onRemove,
}: {
  counts: Counts;
  onEdit: (edit: Edit) => void;
  onShow: (segments: readonly string[]) => void;
  onRemove: () => void;
}) {
  const stations = [...new Set(counts.rows.map(([station]) => station))];
  const total = counts.rows.reduce((sum, [, , , number]) => sum + number, 0);
  const where = t`${plural(counts.rows.length, { one: "# count", other: "# counts" })} at ${plural(stations.length, { one: "# count station", other: "# count stations" })}`;
  const note = t`${where}, ${plural(Math.round(total), { one: "# vehicle", other: "# vehicles" })} in total`;
  return (
    <PartCard
      name={counts.id}
      what={counts.use === "compare" ? t`Counts to compare with` : t`Counts to be reproduced`}
      note={note}
      onRemove={onRemove}
    >
      <MixFold mix={counts.mix} onChange={(mix) => onEdit({ kind: "set_counts", counts: counts.id, mix })} />
      <Group>
        <Button
          size="compact-sm"
          variant="default"
          onClick={() => onShow(stations.flatMap((station) => station.split(">")))}
        >
          <Trans>Show the count stations</Trans>
        </Button>
      </Group>
    </PartCard>
  );
}

export function ZoneList({
  zones,
  onShow,
  onRemove,
}: {
  zones: readonly Zone[];
  onShow: (segments: readonly string[]) => void;
  onRemove: (zone: string) => void;
}) {
  return (
    <section className="fold" aria-label={t`Zones`}>
      <Text fw={600} size="sm">
        <Trans>Zones</Trans>
      </Text>
      {zones.map(({ id, segments }) => (
        <Group key={id} justify="space-between" wrap="nowrap" gap={6}>
          <Text size="sm" style={{ overflowWrap: "anywhere" }}>
            {id}: {plural(segments.length, { one: "# segment", other: "# segments" })}
          </Text>
          <Group gap={4} wrap="nowrap">
            <Button
              size="compact-sm"
              variant="default"
              aria-label={t`Show ${id}`}
              onClick={() => onShow(segments)}
            >
              <Trans>Show</Trans>
            </Button>
            <ActionIcon
              variant="subtle"
              color="gray"
              aria-label={t`Remove ${id}`}
              onClick={() => onRemove(id)}
            >
              <IconTrash />
            </ActionIcon>
          </Group>
        </Group>
      ))}
    </section>
  );
}

/** A small picture of each day profile; those of the scenario can be removed. */
export function ProfileList({
  profiles,
  own,
  onRemove,
}: {
  profiles: Profiles;
  own: readonly string[];
  onRemove: (profile: string) => void;
}) {
  const [open, setOpen] = useState(own.length > 0);
  return (
    <div>
      <Button variant="subtle" size="compact-sm" px={0} aria-expanded={open} onClick={() => setOpen(!open)}>
        {open ? t`Hide the day profiles` : t`Show the day profiles`}
      </Button>
      {open &&
        Object.entries(profiles).map(([id, shares]) => (
          <div key={id} className="profile-row">
            <Group justify="space-between" wrap="nowrap">
              <Text size="sm" fw={500}>
                {profileWord(id)}
              </Text>
              {own.includes(id) ? (
                <ActionIcon
                  variant="subtle"
                  color="gray"
                  aria-label={t`Remove ${id}`}
                  onClick={() => onRemove(id)}
                >
                  <IconTrash />
                </ActionIcon>
              ) : (
                <Text size="xs" c="dimmed">
                  {timeOfDay(86_400 / shares.length) === "01:00" ? t`one bar per hour` : t`one bar per slice`}
                </Text>
              )}
            </Group>
            <ProfileChart name={profileWord(id)} shares={shares} />
          </div>
        ))}
    </div>
  );
}
