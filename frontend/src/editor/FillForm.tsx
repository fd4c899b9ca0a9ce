import { ActionIcon, Button, Group, NumberInput, Slider, Text, Tooltip } from "@mantine/core";
import { useState } from "react";

import { IconDice } from "../ui/icons";
import { count } from "../ui/words";

/** A random crowd in the place of all road users; streams stay. */
export function FillForm({ actors, busy, onFill }: {
  actors: number; busy: boolean; onFill: (share: number, seed: number) => void;
}) {
  const [share, setShare] = useState(30);
  const [seed, setSeed] = useState(1);
  return (
    <div className="fold">
      <div>
        <Text size="sm" fw={500}>How full: {share} %</Text>
        <Slider min={5} max={100} step={5} label={null} value={share} onChange={setShare} thumbLabel="How full, percent" />
      </div>
      <Group gap={6} align="flex-end" wrap="nowrap">
        <NumberInput style={{ flex: 1 }} label="Crowd number" min={0} max={2 ** 31 - 1} allowDecimal={false} value={seed}
          onChange={(value) => setSeed(Number(value) || 0)} />
        <Tooltip label="Roll another crowd">
          <ActionIcon variant="default" size={36} aria-label="Roll another crowd" onClick={() => setSeed(Math.floor(Math.random() * 100_000))}><IconDice /></ActionIcon>
        </Tooltip>
      </Group>
      <Text size="sm" c="dimmed">
        The same number gives the same crowd.{actors > 0 && ` It takes the place of the ${count(actors, "road user")} there; undo brings ${actors === 1 ? "it" : "them"} back.`}
      </Text>
      <Button variant="light" loading={busy} onClick={() => onFill(share / 100, seed)}>Fill the region</Button>
    </div>
  );
}
