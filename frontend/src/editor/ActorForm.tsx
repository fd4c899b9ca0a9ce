import { Checkbox, Group, Select, Stack } from "@mantine/core";
import type { ReactNode } from "react";

import { t } from "@lingui/core/macro";
import type { Actor, Assets, Edit } from "../api/types";
import { DRIVERS, modelWord, styleChoices } from "../ui/words";
import { hasClock } from "../language/moments";
import { Committed } from "./Committed";
import { MomentField } from "./MomentField";
import { bodyOf } from "./scene";
import { Silhouette } from "./Silhouette";

/** The body that was typed; an emptied field gives back the usual one. */
function sized(actor: Actor, length: number | null, width: number | null): Actor["size"] {
  return length === null || width === null ? null : { length, width, height: actor.size?.height ?? null };
}

/** What one road user is and how it moves. */
export function ActorForm({
  actor,
  driverSets,
  assets,
  between,
  onEdit,
}: {
  actor: Actor;
  driverSets: readonly string[];
  assets: Assets | null;
  /** Comes after what is set most. */
  between?: ReactNode;
  onEdit: (edit: Edit) => void;
}) {
  const change = (fields: Partial<Actor>): void =>
    onEdit({ kind: "change_actor", actor: actor.id, ...fields });
  const walks = actor.category === "pedestrian";
  const models = (assets?.blueprints ?? [])
    .filter((one) => one.category === actor.category)
    .map((one) => ({ value: one.id, label: modelWord(one.id) }));
  const [length, width] = bodyOf(actor, assets);
  return (
    <Stack gap="sm">
      {!walks && (
        <Checkbox
          label={t`Ego: my vehicle under test`}
          checked={actor.ego}
          onChange={(event) =>
            onEdit({ kind: "set_ego", actor: event.currentTarget.checked ? actor.id : null })
          }
        />
      )}
      <Group grow align="flex-start">
        <Committed
          label={walks ? t`Walking speed` : t`Desired speed`}
          suffix={" km/h"}
          min={1}
          max={walks ? 15 : 250}
          digits={1}
          placeholder={walks ? t`default` : t`speed limit`}
          value={actor.speed === null ? "" : actor.speed * 3.6}
          onCommit={(value) => change({ speed: value === null ? null : value / 3.6 })}
        />
        <MomentField
          label={hasClock() ? t`Departs at` : t`Departs after`}
          unit="s"
          step={1}
          value={actor.depart}
          onCommit={(value) => change({ depart: value ?? 0 })}
        />
      </Group>
      {!walks && (
        <Committed
          label={t`Speed at departure`}
          suffix={" km/h"}
          min={0}
          max={250}
          digits={1}
          placeholder={t`from rest`}
          value={actor.initial_speed === null ? "" : actor.initial_speed * 3.6}
          onCommit={(value) => change({ initial_speed: value === null ? null : value / 3.6 })}
        />
      )}
      {between}
      <Silhouette actor={actor} length={length} width={width} />
      <Select
        label={t`Model`}
        searchable
        clearable
        placeholder={t`Any`}
        data={models}
        value={actor.model}
        nothingFoundMessage={t`No such model`}
        clearButtonProps={{ "aria-label": t`Any model` }}
        onChange={(model) => change({ model })}
      />
      {!walks && (
        <Group grow align="flex-start">
          <Committed
            label={t`Offset to the left`}
            suffix={" m"}
            min={-3}
            max={3}
            step={0.1}
            digits={2}
            value={actor.lateral_offset}
            onCommit={(value) => change({ lateral_offset: value ?? 0 })}
          />
          <Committed
            label={t`Offset ahead`}
            suffix={" m"}
            min={-10}
            max={10}
            step={0.1}
            digits={2}
            value={actor.longitudinal_offset}
            onCommit={(value) => change({ longitudinal_offset: value ?? 0 })}
          />
        </Group>
      )}
      {!walks && (
        <Group grow align="flex-start">
          <Committed
            label={t`Length`}
            suffix={" m"}
            min={0.1}
            max={30}
            step={0.1}
            digits={2}
            value={length}
            onCommit={(value) => change({ size: sized(actor, value, width) })}
          />
          <Committed
            label={t`Width`}
            suffix={" m"}
            min={0.1}
            max={5}
            step={0.05}
            digits={2}
            value={width}
            onCommit={(value) => change({ size: sized(actor, length, value) })}
          />
          <Select
            label={t`Driving style`}
            allowDeselect={false}
            value={actor.style}
            data={styleChoices(driverSets)}
            onChange={(style) => {
              if (style) change({ style });
            }}
          />
        </Group>
      )}
      {!walks && (
        <Select
          label={t`Driven by`}
          description={
            actor.driver === "story" ? t`Keeps its speed and lane, and hits what is in the way` : undefined
          }
          allowDeselect={false}
          value={actor.driver}
          data={Object.entries(DRIVERS()).map(([value, label]) => ({ value, label }))}
          onChange={(driver) => {
            if (driver === "sumo" || driver === "story") change({ driver });
          }}
        />
      )}
      {walks && (
        <Checkbox
          label={t`Crosses the road anywhere`}
          description={t`Where it is shortest, not at crosswalks only`}
          checked={actor.crosses_anywhere}
          onChange={(event) => change({ crosses_anywhere: event.currentTarget.checked })}
        />
      )}
      {walks && (
        <Checkbox
          label={t`Ignores red lights`}
          checked={actor.ignores_red}
          onChange={(event) => change({ ignores_red: event.currentTarget.checked })}
        />
      )}
    </Stack>
  );
}

/** Changes that several road users can share; each is one step for undo. */
export function ManyForm({
  actors,
  driverSets,
  onChange,
}: {
  actors: readonly Actor[];
  driverSets: readonly string[];
  onChange: (fields: Partial<Actor>, what: string) => void;
}) {
  const [first, ...others] = actors;
  const same = <K extends keyof Actor>(key: K): Actor[K] | undefined =>
    others.every((one) => one[key] === first?.[key]) ? first?.[key] : undefined;
  const speed = same("speed");
  return (
    <Stack gap="sm">
      <Group grow align="flex-start">
        <Committed
          label={t`Desired speed of all`}
          suffix={" km/h"}
          min={1}
          max={250}
          digits={1}
          placeholder={speed === undefined ? t`different` : t`default`}
          value={speed ? speed * 3.6 : ""}
          onCommit={(value) => onChange({ speed: value === null ? null : value / 3.6 }, t`Speed`)}
        />
        <MomentField
          label={hasClock() ? t`All depart at` : t`All depart after`}
          unit="s"
          step={1}
          placeholder={t`different`}
          value={same("depart") ?? null}
          onCommit={(value) => onChange({ depart: value ?? 0 }, t`Departure`)}
        />
      </Group>
      <Select
        label={t`Driving style of all`}
        placeholder={t`different`}
        allowDeselect={false}
        value={same("style") ?? null}
        data={styleChoices(driverSets)}
        onChange={(style) => {
          if (style) onChange({ style }, t`Driving style`);
        }}
      />
    </Stack>
  );
}
