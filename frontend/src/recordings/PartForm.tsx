import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { Button, Radio, Select, Stack, Text } from "@mantine/core";
import { memo, useState } from "react";

import { type Follow, recordings, type RecordingInfo } from "../api/recordings";
import { fixed } from "../language/numbers";
import { go } from "../ui/address";
import { tellError } from "../ui/notices";
import { CATEGORY_WORD } from "../ui/words";
import type { Part } from "./window";
import { FOLLOWS, recordedTime } from "./words";

/** What becomes of the part that is chosen: who is the ego, and what the others do. */
export const PartForm = memo(function PartForm({
  info,
  part,
  ego,
  onEgo,
}: {
  info: RecordingInfo;
  part: Part;
  ego: string | null;
  onEgo: (ego: string | null) => void;
}) {
  const [follow, setFollow] = useState<Follow>("react");
  const [busy, setBusy] = useState(false);
  const there = info.users.filter(({ begin, end }) => begin <= part.end && end >= part.begin);
  const drivers = there.filter(({ category }) => category !== "pedestrian");
  const make = (): void => {
    setBusy(true);
    recordings
      .scenario(info.name, { ...part, ego: ego ?? "", follow })
      .then((made) => {
        if (made !== null) go({ view: "editor", scenario: made });
      }, tellError)
      .finally(() => setBusy(false));
  };
  return (
    <Stack gap="sm">
      <Text size="sm">
        <Trans>
          From {recordedTime(info, part.begin)} to {recordedTime(info, part.end)}:{" "}
          {fixed(part.end - part.begin, 1)} s with {there.length} road users. Drag over the bar for another
          part.
        </Trans>
      </Text>
      <Select
        label={t`Ego`}
        description={t`Or click a vehicle on the map. It is free for SUMO, CARLA or a driver of yours.`}
        placeholder={t`None`}
        data={drivers.map(({ id, category }) => ({
          value: id,
          label: `${id} (${CATEGORY_WORD()[category]})`,
        }))}
        value={drivers.some(({ id }) => id === ego) ? ego : null}
        onChange={onEgo}
        clearable
        searchable
        clearButtonProps={{ "aria-label": t`No ego` }}
      />
      <Radio.Group
        label={t`The others`}
        value={follow}
        onChange={(next) => setFollow(FOLLOWS().find(({ value }) => value === next)?.value ?? "track")}
      >
        <Stack gap={6} mt={4}>
          {FOLLOWS().map(({ value, label, text }) => (
            <Radio key={value} value={value} label={label} description={text} size="sm" />
          ))}
        </Stack>
      </Radio.Group>
      <Button onClick={make} loading={busy} disabled={info.map === null || there.length === 0}>
        <Trans>Make a scenario</Trans>
      </Button>
      {info.map === null && (
        <Text size="xs" c="dimmed">
          <Trans>A scenario needs a map: choose the one that the recording is of.</Trans>
        </Text>
      )}
    </Stack>
  );
});
