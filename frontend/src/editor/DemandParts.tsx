import { ActionIcon, Button, Collapse, Group, Text } from "@mantine/core";
import { type ReactNode, useState } from "react";

import type { Counts, Matrix, Mix, Zone } from "../api/demand";
import type { Edit, FieldsOf } from "../api/types";
import { IconTrash } from "../ui/icons";
import { count, span } from "../ui/words";
import { Committed } from "./Committed";
import { ProfileChart, ProfileChoice, type Profiles, profileWord } from "./DayProfiles";
import { mixWords, timeOfDay, tripsOf } from "./demand";
import { MixForm } from "./MixForm";

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
        <ActionIcon variant="subtle" color="gray" aria-label={`Remove ${name}`} onClick={onRemove}>
          <IconTrash />
        </ActionIcon>
      </Group>
      {children}
    </section>
  );
}

/** From when until when a part of the traffic departs, in minutes of the run. */
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
      <Committed
        label="From"
        suffix=" min"
        min={0}
        max={1e5}
        digits={1}
        value={begin / 60}
        onCommit={(value) => onChange({ begin: (value ?? 0) * 60 })}
      />
      <Committed
        label="Until"
        suffix=" min"
        min={0.1}
        max={1e5}
        digits={1}
        placeholder="the end"
        value={end === null ? "" : end / 60}
        onCommit={(value) => onChange({ end: value === null ? null : value * 60 })}
      />
    </Group>
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
        {open ? "Hide the mix" : "Change the mix"}
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
    matrix.end === null ? "until the end of the run" : `${span(matrix.begin, matrix.end)} of the run`;
  const note = `${count(Math.round(tripsOf(matrix)), "trip")} in ${count(matrix.trips.length, "row")}, ${when}`;
  return (
    <PartCard name={matrix.id} what="Trips between zones" note={note} onRemove={onRemove}>
      <WindowFields begin={matrix.begin} end={matrix.end} onChange={change} />
      <ProfileChoice value={matrix.profile} profiles={profiles} onChange={(profile) => change({ profile })} />
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
  const where = `${count(counts.rows.length, "count")} at ${count(stations.length, "count station")}`;
  const note = `${where}, ${count(Math.round(total), "vehicle")} in total`;
  return (
    <PartCard
      name={counts.id}
      what={counts.use === "compare" ? "Counts to compare with" : "Counts to be reproduced"}
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
          Show the count stations
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
    <section className="fold" aria-label="Zones">
      <Text fw={600} size="sm">
        Zones
      </Text>
      {zones.map(({ id, segments }) => (
        <Group key={id} justify="space-between" wrap="nowrap" gap={6}>
          <Text size="sm" style={{ overflowWrap: "anywhere" }}>
            {id}: {count(segments.length, "segment")}
          </Text>
          <Group gap={4} wrap="nowrap">
            <Button
              size="compact-sm"
              variant="default"
              aria-label={`Show ${id}`}
              onClick={() => onShow(segments)}
            >
              Show
            </Button>
            <ActionIcon
              variant="subtle"
              color="gray"
              aria-label={`Remove ${id}`}
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
        {open ? "Hide the day profiles" : "Show the day profiles"}
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
                  aria-label={`Remove ${id}`}
                  onClick={() => onRemove(id)}
                >
                  <IconTrash />
                </ActionIcon>
              ) : (
                <Text size="xs" c="dimmed">
                  one bar per {timeOfDay(86_400 / shares.length) === "01:00" ? "hour" : "slice"}
                </Text>
              )}
            </Group>
            <ProfileChart name={profileWord(id)} shares={shares} />
          </div>
        ))}
    </div>
  );
}
