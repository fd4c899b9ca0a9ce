import { Group, Stack, Text } from "@mantine/core";

import { CATEGORIES, type Category, type Edit, type Flow } from "../api/types";
import { CATEGORY_WORD } from "../ui/words";
import { Committed } from "./Committed";

const VEHICLES = CATEGORIES.filter((category) => category !== "pedestrian");

/** How many come, when, and of which kinds. */
export function FlowForm({ flow, onEdit }: { flow: Flow; onEdit: (edit: Edit) => void }) {
  const change = (fields: Partial<Flow>): void => onEdit({ kind: "change_flow", flow: flow.id, ...fields });
  const walks = "pedestrian" in flow.mix;
  const total = Object.values(flow.mix).reduce((sum, share) => sum + share, 0);
  const setShare = (category: Category, share: number): void => {
    const rest = Object.entries(flow.mix).filter(([other]) => other !== category);
    const mix = Object.fromEntries(share > 0 ? [...rest, [category, share]] : rest);
    if (Object.keys(mix).length > 0) change({ mix });
  };
  return (
    <Stack gap="sm">
      <Committed label={walks ? "People an hour" : "Vehicles an hour"} suffix="" min={1} max={20_000} step={50} digits={0} value={flow.per_hour}
        onCommit={(value) => change({ per_hour: value ?? flow.per_hour })} />
      <Group grow align="flex-start">
        <Committed label="From" suffix=" s" min={0} max={1e6} step={10} digits={0} value={flow.begin}
          onCommit={(value) => change({ begin: value ?? 0 })} />
        <Committed label="Until" suffix=" s" min={1} max={1e6} step={10} digits={0} value={flow.end}
          onCommit={(value) => change({ end: value ?? flow.end })} />
      </Group>
      <Committed label={walks ? "Walking speed" : "Desired speed"} suffix=" km/h" min={1} max={walks ? 15 : 250} digits={1}
        placeholder={walks ? "usual" : "the limit"} value={flow.speed === null ? "" : flow.speed * 3.6}
        onCommit={(value) => change({ speed: value === null ? null : value / 3.6 })} />
      {!walks && (
        <fieldset className="mix">
          <legend>Shares of the kinds</legend>
          {VEHICLES.map((category) => (
            <Committed key={category} label={CATEGORY_WORD[category]} suffix="" min={0} max={1000} digits={2} value={flow.mix[category] ?? 0}
              onCommit={(share) => setShare(category, share ?? 0)} />
          ))}
          <Text size="xs" c="dimmed">{VEHICLES.filter((one) => flow.mix[one]).map((one) =>
            `${CATEGORY_WORD[one]} ${Math.round((100 * (flow.mix[one] ?? 0)) / total)} %`).join(", ")}</Text>
        </fieldset>
      )}
    </Stack>
  );
}
