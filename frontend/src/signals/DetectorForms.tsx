import { ActionIcon, Group, MultiSelect, Select, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import type { LightProgram } from "../api/signals";
import { Committed } from "../editor/Committed";
import { CommittedText, PickButton } from "../editor/FormParts";
import { IconTrash } from "../ui/icons";
import type { ApproachNames } from "../map/placeNames";
import type { SignalEditing, Timing } from "./editing";
import { freeName, stageLabel } from "./GroupForms";
import { Refused } from "./Refused";
import { useAttempt } from "./useAttempt";

type Detector = Timing["detectors"][number];

interface Props {
  light: LightProgram;
  junction: string;
  names: ApproachNames;
  editing: SignalEditing;
}

/** Detectors of the scenario before a light: their places, and the stages that they prolong. */
export function DetectorForms({ light, junction, names, editing }: Props) {
  const detectors = editing.timing?.detectors ?? [];
  const attempt = useAttempt(editing);
  const id = freeName(new Set(detectors.map((one) => one.id)), "D");
  const lay = (at: string, before: number): void => {
    const stages = stagesAt(light, at);
    void attempt.ask([{ kind: "set_detector", junction, detector: id, at, before, stages }]);
  };
  return (
    <div className="signal-forms">
      {light.control !== "actuated" && (
        <Text size="sm" c="dimmed">
          <Trans>They act with actuated control only, which this light does not have.</Trans>
        </Text>
      )}
      {detectors.length === 0 && (
        <Text size="sm" c="dimmed">
          <Trans>Without any, each lane has a loop of its own with actuated control.</Trans>
        </Text>
      )}
      {detectors.map((one) => (
        <DetectorForm
          key={one.id}
          one={one}
          light={light}
          junction={junction}
          names={names}
          editing={editing}
        />
      ))}
      <PickButton
        pick={editing.pick}
        pickKey={`detector new ${junction}`}
        by="loop"
        style={{ justifySelf: "start" }}
        onTake={({ name, s }) => lay(name, s)}
      >
        {t`Place a detector on the map`}
      </PickButton>
      <Text size="xs" c="dimmed">
        <Trans>
          Then click a lane before the stop line, or move the map with the arrow keys and press Enter. A
          detector on the map can be dragged along its lane.
        </Trans>
      </Text>
      <Refused by={attempt} />
    </div>
  );
}

function DetectorForm({ one, light, junction, names, editing }: Props & { one: Detector }) {
  const { id } = one;
  const attempt = useAttempt(editing);
  const set = { kind: "set_detector", junction, detector: id } as const;
  const plan = light.plans[0];
  const stages = (plan?.stages ?? []).map((stage) => ({
    value: stage.id,
    label: stageLabel(stage.id, stage.groups),
  }));
  const places = [
    ...new Set(light.lanes.map(({ approach }) => approach)),
    ...light.lanes.map(({ at }) => at),
  ];
  const approach = new Set(light.lanes.map((lane) => lane.approach));
  return (
    <section className="fold" aria-label={t`Detector ${id}`}>
      <Group justify="space-between" align="flex-end" wrap="nowrap">
        <CommittedText
          label={t`Name`}
          value={id}
          maxLength={64}
          onCommit={(name) => void attempt.ask([{ ...set, id: name }])}
        />
        <ActionIcon
          variant="subtle"
          color="gray"
          size="lg"
          aria-label={t`Remove ${id}`}
          onClick={() => void attempt.ask([{ kind: "remove_detector", junction, detector: id }])}
        >
          <IconTrash />
        </ActionIcon>
      </Group>
      <Select
        label={t`Approach or lane`}
        data={[...new Set([...places, one.at])].map((value) => ({
          value,
          label: approach.has(value) ? t`${names.approach(value)}, each lane` : names.lane(value),
        }))}
        value={one.at}
        allowDeselect={false}
        onChange={(at) => {
          if (at) void attempt.ask([{ ...set, at }]);
        }}
      />
      <Group grow gap="xs" align="flex-end" wrap="nowrap">
        <Committed
          label={t`To the stop line`}
          suffix={" m"}
          min={0}
          max={1000}
          digits={1}
          value={one.before}
          onCommit={(before) => {
            if (before !== null) void attempt.ask([{ ...set, before }]);
          }}
        />
        <Committed
          label={t`Length`}
          suffix={" m"}
          min={0.1}
          max={100}
          digits={1}
          value={one.length}
          onCommit={(length) => {
            if (length !== null) void attempt.ask([{ ...set, length }]);
          }}
        />
        <Committed
          label={t`Passage gap`}
          suffix={" s"}
          min={0.1}
          max={60}
          digits={1}
          value={one.gap}
          onCommit={(gap) => {
            if (gap !== null) void attempt.ask([{ ...set, gap }]);
          }}
        />
      </Group>
      <MultiSelect
        label={t`Prolongs the green of`}
        data={stages}
        value={[...one.stages]}
        onChange={(chosen) => {
          if (chosen.length > 0) void attempt.ask([{ ...set, stages: chosen }]);
          else attempt.say(t`A detector needs a stage. Remove it if it is for none.`);
        }}
      />
      <Refused by={attempt} />
      <PickButton
        pick={editing.pick}
        pickKey={`detector ${junction} ${id}`}
        by="loop"
        style={{ justifySelf: "start" }}
        onTake={({ name, s }) => void attempt.ask([{ ...set, at: name, before: s }])}
      >
        {t`Place ${id} on the map`}
      </PickButton>
    </section>
  );
}

/** Stages in which a movement from a lane has green: what a loop there is most likely for. */
function stagesAt(light: LightProgram, at: string): string[] {
  const approach = light.lanes.find((lane) => lane.at === at)?.approach ?? at;
  const groups = new Set(
    light.movements
      .filter(({ name }) => [approach, at].includes(name.split(/[ >]/)[0] ?? ""))
      .map(({ group }) => group),
  );
  const stages = light.plans[0]?.stages ?? [];
  const green = stages.filter((stage) => stage.groups.some((group) => groups.has(group)));
  return (green.length > 0 ? green : stages.slice(0, 1)).map(({ id }) => id);
}
