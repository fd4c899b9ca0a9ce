import { Select } from "@mantine/core";

import { t } from "@lingui/core/macro";
import type { Background } from "../api/demand";
import type { Edit, FieldsOf } from "../api/types";
import { Committed } from "./Committed";
import { ProfileChoice, type Profiles } from "./DayProfiles";
import { AMOUNTS, amountOf } from "./demand";
import { ArrivalsChoice, MixFold, PartCard, WindowFields } from "./DemandParts";

/** Vehicles with random starts and goals: how many, when, and their mix. */
export function BackgroundForm({
  background,
  profiles,
  onEdit,
  onRemove,
}: {
  background: Background;
  profiles: Profiles;
  onEdit: (edit: Edit) => void;
  onRemove: () => void;
}) {
  const amount = amountOf(background);
  const change = (fields: FieldsOf<"set_background", "background">): void =>
    onEdit({ kind: "set_background", background: background.id, ...fields });
  return (
    <PartCard name={background.id} what={t`Background traffic`} onRemove={onRemove}>
      <Select
        label={t`Amount given as`}
        data={AMOUNTS().map(({ key, word }) => ({ value: key, label: word }))}
        value={amount.key}
        allowDeselect={false}
        onChange={(key) => {
          const chosen = AMOUNTS().find((one) => one.key === key);
          if (chosen && chosen !== amount) change({ [chosen.key]: chosen.begin });
        }}
      />
      <Committed
        label={amount.unit}
        suffix={amount.suffix}
        min={amount.min}
        max={amount.max}
        digits={amount.digits}
        value={(background[amount.key] ?? amount.begin) * amount.scale}
        onCommit={(value) => {
          if (value !== null) change({ [amount.key]: value / amount.scale });
        }}
      />
      <WindowFields begin={background.begin} end={background.end} onChange={change} />
      <ProfileChoice
        value={background.profile}
        profiles={profiles}
        onChange={(profile) => change({ profile })}
      />
      <ArrivalsChoice value={background.arrivals} onChange={(arrivals) => change({ arrivals })} />
      <MixFold mix={background.mix} onChange={(mix) => change({ mix })} />
    </PartCard>
  );
}
