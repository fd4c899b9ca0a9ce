import { ActionIcon, Button, Group, NumberInput, Slider, Text, Tooltip } from "@mantine/core";
import { useState } from "react";

import type { Filler } from "../api/generators";
import { IconDice } from "../ui/icons";
import { count } from "../ui/words";
import { GeneratorForm } from "./GeneratorForm";

/** Road users, random ones or those of a generator, in the place of all that were placed; flows stay. */
export function FillForm({
  actors,
  busy,
  onFill,
}: {
  actors: number;
  busy: boolean;
  onFill: (share: number, seed: number, filler: Filler | null) => void;
}) {
  const [share, setShare] = useState(30);
  const [seed, setSeed] = useState(1);
  const [filler, setFiller] = useState<Filler | null>(null);
  const replaced =
    actors === 1
      ? "the road user of the scenario; undo restores it"
      : `the ${count(actors, "road user")} of the scenario; undo restores them`;
  return (
    <div className="fold">
      <GeneratorForm filler={filler} onChange={setFiller} />
      <div>
        <Text size="sm" fw={500}>
          Density: {share} % of the maximum
        </Text>
        <Slider
          min={5}
          max={100}
          step={5}
          label={null}
          value={share}
          onChange={setShare}
          thumbLabel="Density, percent of the maximum"
        />
      </div>
      <Group gap={6} align="flex-end" wrap="nowrap">
        <NumberInput
          style={{ flex: 1 }}
          label="Random seed"
          min={0}
          max={2 ** 31 - 1}
          allowDecimal={false}
          value={seed}
          onChange={(value) => setSeed(Number(value) || 0)}
        />
        <Tooltip label="New random seed">
          <ActionIcon
            variant="default"
            size={36}
            aria-label="New random seed"
            onClick={() => setSeed(Math.floor(Math.random() * 100_000))}
          >
            <IconDice />
          </ActionIcon>
        </Tooltip>
      </Group>
      <Text size="sm" c="dimmed">
        The same seed gives the same road users.{actors > 0 && ` They replace ${replaced}.`}
      </Text>
      <Button variant="light" loading={busy} onClick={() => onFill(share / 100, seed, filler)}>
        Fill the region
      </Button>
    </div>
  );
}
