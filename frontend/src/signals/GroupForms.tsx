import { Button, Group, MultiSelect, SegmentedControl, Select, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import type { LightProgram } from "../api/signals";
import { localized } from "../language/localized";
import { Committed } from "../editor/Committed";
import { CommittedText } from "../editor/FormParts";
import type { ApproachNames } from "../map/placeNames";
import { byNameOrId } from "../ui/choices";
import type { SignalEditing, Timing } from "./editing";
import { conflictWords, type Green, greenOf, type ProgramGroup, withGreen } from "./greens";
import { Refused } from "./Refused";
import { useAttempt } from "./useAttempt";

interface Props {
  light: LightProgram;
  junction: string;
  names: ApproachNames;
  timing: Timing;
  editing: SignalEditing;
}

/** Seconds of green of a new stage. */
const NEW_STAGE = 10;

const GREENS = localized((): { value: Green; label: string }[] => [
  { value: "red", label: t`Red` },
  { value: "protected", label: t`Green` },
  { value: "permissive", label: t`Gives way` },
]);

/** Signal groups of a program: their movements, least green, and the stages in which they are green. */
export function GroupForms({ light, junction, names, timing, editing }: Props) {
  const [open, setOpen] = useState<string | null>(null);
  return (
    <div className="signal-forms">
      {timing.groups.map((group) => (
        <section key={group.id} className="fold" aria-label={t`Signal group ${group.id}`}>
          <Group justify="space-between" wrap="nowrap" gap={8} align="flex-start">
            <div>
              <Text fw={600} size="sm">
                {group.id}
              </Text>
              <Text size="xs" c="dimmed">
                {names.movements(group.movements)}
              </Text>
            </div>
            <Button
              size="compact-sm"
              variant="default"
              aria-expanded={open === group.id}
              aria-label={open === group.id ? t`Done ${group.id}` : t`Change ${group.id}`}
              style={{ flexShrink: 0 }}
              onClick={() => setOpen(open === group.id ? null : group.id)}
            >
              {open === group.id ? t`Done` : t`Change`}
            </Button>
          </Group>
          {open === group.id && (
            <GroupForm
              light={light}
              junction={junction}
              names={names}
              timing={timing}
              editing={editing}
              group={group}
              onName={setOpen}
            />
          )}
        </section>
      ))}
      <NewGroup
        light={light}
        junction={junction}
        names={names}
        timing={timing}
        editing={editing}
        onMade={setOpen}
      />
      <StageList junction={junction} timing={timing} editing={editing} />
    </div>
  );
}

function GroupForm({
  light,
  junction,
  names,
  timing,
  editing,
  group,
  onName,
}: Props & { group: ProgramGroup; onName: (name: string | null) => void }) {
  const { id } = group;
  const naming = useAttempt(editing);
  const members = useAttempt(editing);
  const times = useAttempt(editing);
  const greens = useAttempt(editing);
  const others = timing.groups.filter((one) => one.id !== id).map((one) => one.id);
  const set = { kind: "set_group", junction, group: id } as const;
  const rename = async (name: string): Promise<void> => {
    if (others.includes(name)) naming.say(t`${name} is taken`);
    else if (name === "") naming.say(t`A signal group needs a name`);
    else if (await naming.ask([{ ...set, id: name }])) onName(name);
  };
  const choose = (stage: string, green: Green): void => {
    const one = timing.stages.find((each) => each.id === stage);
    const words = one ? conflictWords(light.pairs, one, id, green) : null;
    if (words) greens.say(words);
    else void greens.ask([{ ...set, ...withGreen(timing.stages, id, stage, green) }]);
  };
  const seconds = (label: string, field: "min_green" | "yellow" | "all_red", placeholder: string) => (
    <Committed
      label={label}
      suffix={" s"}
      min={0}
      max={3600}
      digits={1}
      placeholder={placeholder}
      value={group[field] ?? ""}
      onCommit={(value) => void times.ask([{ ...set, [field]: value }])}
    />
  );
  const stageIds = new Set(timing.stages.map((one) => one.id));
  const fresh = freeName(stageIds, "");
  const last = timing.stages.findLast((one) => greenOf(one, id) !== "red")?.id ?? null;
  return (
    <>
      <CommittedText label={t`Name`} value={id} maxLength={64} onCommit={(name) => void rename(name)} />
      <Refused by={naming} />
      <MovementSelect
        light={light}
        names={names}
        group={id}
        value={movementsOf(light, id)}
        onChange={(movements) => {
          if (movements.length > 0) void members.ask([{ ...set, movements }]);
          else members.say(t`A signal group needs a movement. Remove the group to let another have them.`);
        }}
      />
      <Refused by={members} />
      <Group grow gap="xs" align="flex-end" wrap="nowrap">
        {seconds(t`Least green`, "min_green", t`none`)}
        {seconds(t`Yellow`, "yellow", t`auto`)}
        {seconds(t`All red`, "all_red", t`auto`)}
      </Group>
      <Refused by={times} />
      <Text size="sm" fw={500}>
        <Trans>Green in the stages</Trans>
      </Text>
      {timing.stages.map((stage) => (
        <div key={stage.id} className="signal-turn">
          <span>{t`Stage ${stage.id}`}</span>
          <SegmentedControl
            size="xs"
            data={GREENS()}
            value={greenOf(stage, id)}
            aria-label={t`${id} in stage ${stage.id}`}
            onChange={(value) => choose(stage.id, value as Green)}
          />
        </div>
      ))}
      <Refused by={greens} />
      <Group gap="xs" align="flex-end">
        <Button
          size="compact-sm"
          variant="default"
          onClick={() =>
            void greens.ask([
              {
                kind: "add_stage",
                junction,
                stage: fresh,
                after: last,
                protected: [id],
                green: Math.max(NEW_STAGE, group.min_green ?? 0),
              },
            ])
          }
        >
          <Trans>New stage for it</Trans>
        </Button>
        {others.length > 0 && (
          <Select
            size="xs"
            label={t`Remove ${id}; its movements join`}
            placeholder={t`another group`}
            data={others}
            value={null}
            onChange={(into) => {
              if (into)
                void greens.ask([{ kind: "remove_group", junction, group: id, into }]).then((done) => {
                  if (done) onName(null);
                });
            }}
          />
        )}
      </Group>
    </>
  );
}

function NewGroup({
  light,
  junction,
  names,
  timing,
  editing,
  onMade,
}: Props & { onMade: (name: string) => void }) {
  const [open, setOpen] = useState(false);
  const [name, setName] = useState("");
  const [movements, setMovements] = useState<string[]>([]);
  const attempt = useAttempt(editing);
  const taken = new Set(timing.groups.map(({ id }) => id));
  const id = name.trim() || freeName(taken, "K");
  const make = async (): Promise<void> => {
    if (taken.has(id)) return attempt.say(t`${id} is taken`);
    if (!(await attempt.ask([{ kind: "set_group", junction, group: id, movements }]))) return;
    setOpen(false);
    setName("");
    setMovements([]);
    onMade(id);
  };
  if (!open)
    return (
      <Button
        size="compact-sm"
        variant="default"
        style={{ justifySelf: "start" }}
        onClick={() => setOpen(true)}
      >
        <Trans>New signal group</Trans>
      </Button>
    );
  return (
    <section className="fold" aria-label={t`New signal group`}>
      <TextInput
        label={t`Name`}
        placeholder={id}
        value={name}
        maxLength={64}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <MovementSelect light={light} names={names} group={id} value={movements} onChange={setMovements} />
      <Text size="xs" c="dimmed">
        <Trans>
          It is green with the group that has the first of them now, until you choose other stages.
        </Trans>
      </Text>
      <Refused by={attempt} />
      <Group gap="xs">
        <Button size="compact-sm" disabled={movements.length === 0} onClick={() => void make()}>
          <Trans>Add the group</Trans>
        </Button>
        <Button size="compact-sm" variant="default" onClick={() => setOpen(false)}>
          <Trans>Cancel</Trans>
        </Button>
      </Group>
    </section>
  );
}

/** Movements of a group: those of others are taken from them. */
function MovementSelect({
  light,
  names,
  group,
  value,
  onChange,
}: {
  light: LightProgram;
  names: ApproachNames;
  group: string;
  value: string[];
  onChange: (movements: string[]) => void;
}) {
  const data = light.movements.map((one) => {
    const label = names.movement(one.name);
    return {
      value: one.name,
      label: one.group && one.group !== group ? t`${label} (now in ${one.group})` : label,
    };
  });
  return (
    <MultiSelect
      label={t`Turns and crossings`}
      data={data}
      value={value}
      searchable
      filter={byNameOrId}
      hidePickedOptions
      onChange={onChange}
    />
  );
}

/** The stages in their order, to be taken out. */
function StageList({ junction, timing, editing }: Omit<Props, "light" | "names">) {
  const attempt = useAttempt(editing);
  return (
    <>
      <Select
        size="xs"
        label={t`Remove a stage`}
        placeholder={t`choose a stage`}
        data={timing.stages.map((stage) => ({
          value: stage.id,
          label: stageLabel(stage.id, [...stage.protected, ...stage.permissive]),
        }))}
        value={null}
        onChange={(stage) => {
          if (stage) void attempt.ask([{ kind: "remove_stage", junction, stage }]);
        }}
      />
      <Refused by={attempt} />
    </>
  );
}

const movementsOf = (light: LightProgram, group: string): string[] =>
  light.movements.filter((one) => one.group === group).map(({ name }) => name);

/** A stage with the groups that are green in it. */
export const stageLabel = (stage: string, groups: readonly string[]): string =>
  groups.length > 0 ? t`Stage ${stage}: ${groups.join(" ")}` : t`Stage ${stage}`;

/** A name that is free: a letter and the first number that is not taken. */
export function freeName(taken: ReadonlySet<string>, letter: string): string {
  let number = 1;
  while (taken.has(`${letter}${number}`)) number++;
  return `${letter}${number}`;
}
