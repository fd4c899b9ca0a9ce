import { ActionIcon, Button, Group, NumberInput, Slider, Text, Tooltip } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { type Chosen, models } from "../api/models";
import { IconDice } from "../ui/icons";
import { ModelChoice } from "./ModelChoice";

/** Road users, random ones or those of a generator, in the place of all that were placed; flows stay. */
export function FillForm({
  actors,
  busy,
  onFill,
}: {
  actors: number;
  busy: boolean;
  onFill: (share: number, seed: number, filler: Chosen | null) => void;
}) {
  const [share, setShare] = useState(30);
  const [seed, setSeed] = useState(1);
  const [filler, setFiller] = useState<Chosen | null>(null);
  return (
    <div className="fold">
      <ModelChoice
        offered={models.generators}
        label={t`Placed by`}
        none={t`Random`}
        words={(name) => t`Generator ${name}`}
        unusable={t`This generator cannot be used`}
        chosen={filler}
        onChange={setFiller}
      />
      <div>
        <Text size="sm" fw={500}>
          <Trans>Density: {share} % of the maximum</Trans>
        </Text>
        <Slider
          min={5}
          max={100}
          step={5}
          label={null}
          value={share}
          onChange={setShare}
          thumbLabel={t`Density, percent of the maximum`}
        />
      </div>
      <Group gap={6} align="flex-end" wrap="nowrap">
        <NumberInput
          style={{ flex: 1 }}
          label={t`Random seed`}
          min={0}
          max={2 ** 31 - 1}
          allowDecimal={false}
          value={seed}
          onChange={(value) => setSeed(Number(value) || 0)}
        />
        <Tooltip label={t`New random seed`}>
          <ActionIcon
            variant="default"
            size={36}
            aria-label={t`New random seed`}
            onClick={() => setSeed(Math.floor(Math.random() * 100_000))}
          >
            <IconDice />
          </ActionIcon>
        </Tooltip>
      </Group>
      <Text size="sm" c="dimmed">
        {t`The same seed gives the same road users.`}
        {actors > 0 && ` ${replacedWords(actors)}`}
      </Text>
      <Button variant="light" loading={busy} onClick={() => onFill(share / 100, seed, filler)}>
        <Trans>Fill the region</Trans>
      </Button>
    </div>
  );
}

const replacedWords = (actors: number): string =>
  plural(actors, {
    one: "They replace the road user of the scenario; undo restores it.",
    other: "They replace the # road users of the scenario; undo restores them.",
  });
