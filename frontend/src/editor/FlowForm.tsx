import { Group, Stack } from "@mantine/core";

import { t } from "@lingui/core/macro";
import type { Edit, Flow } from "../api/types";
import { Committed } from "./Committed";
import { ProfileChoice, type Profiles } from "./DayProfiles";
import { MixForm } from "./MixForm";
import { MomentField } from "./MomentField";

/** Volume, time and mix of a flow. */
export function FlowForm({
  flow,
  profiles,
  onEdit,
}: {
  flow: Flow;
  profiles: Profiles;
  onEdit: (edit: Edit) => void;
}) {
  const change = (fields: Partial<Flow>): void => onEdit({ kind: "change_flow", flow: flow.id, ...fields });
  const walks = "pedestrian" in flow.mix;
  return (
    <Stack gap="sm">
      <Committed
        label={walks ? t`Pedestrians per hour` : t`Vehicles per hour`}
        suffix=""
        min={1}
        max={20_000}
        step={50}
        digits={0}
        value={flow.per_hour}
        onCommit={(value) => change({ per_hour: value ?? flow.per_hour })}
      />
      <ProfileChoice value={flow.profile} profiles={profiles} onChange={(profile) => change({ profile })} />
      <Group grow align="flex-start">
        <MomentField
          label={t`From`}
          unit="s"
          step={10}
          value={flow.begin}
          onCommit={(value) => change({ begin: value ?? 0 })}
        />
        <MomentField
          label={t`Until`}
          unit="s"
          step={10}
          value={flow.end}
          onCommit={(value) => change({ end: value ?? flow.end })}
        />
      </Group>
      <Committed
        label={walks ? t`Walking speed` : t`Desired speed`}
        suffix={" km/h"}
        min={1}
        max={walks ? 15 : 250}
        digits={1}
        placeholder={walks ? t`default` : t`speed limit`}
        value={flow.speed === null ? "" : flow.speed * 3.6}
        onCommit={(value) => change({ speed: value === null ? null : value / 3.6 })}
      />
      {!walks && <MixForm mix={flow.mix} onChange={(mix) => change({ mix })} />}
    </Stack>
  );
}
