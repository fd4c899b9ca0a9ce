import { Text } from "@mantine/core";

import { Trans } from "@lingui/react/macro";
import type { Mix } from "../api/demand";
import { CATEGORIES, type Category } from "../api/types";
import { CATEGORY_WORD } from "../ui/words";
import { Committed } from "./Committed";
import { mixWords } from "./demand";

const VEHICLES = CATEGORIES.filter((category) => category !== "pedestrian");

/** Shares of the kinds of road users; at least one stays. */
export function MixForm({
  mix,
  pedestrians = false,
  onChange,
}: {
  mix: Mix;
  /** Whether pedestrians can be among them. */
  pedestrians?: boolean;
  onChange: (mix: Mix) => void;
}) {
  const setShare = (category: Category, share: number): void => {
    const rest = Object.entries(mix).filter(([other]) => other !== category);
    const next = Object.fromEntries(share > 0 ? [...rest, [category, share]] : rest);
    if (Object.keys(next).length > 0) onChange(next);
  };
  return (
    <fieldset className="mix">
      <legend>
        <Trans>Mix of road users</Trans>
      </legend>
      {(pedestrians ? CATEGORIES : VEHICLES).map((category) => (
        <Committed
          key={category}
          label={CATEGORY_WORD()[category]}
          suffix=""
          min={0}
          max={1000}
          digits={2}
          value={mix[category] ?? 0}
          onCommit={(share) => setShare(category, share ?? 0)}
        />
      ))}
      <Text size="xs" c="dimmed">
        {mixWords(mix)}
      </Text>
    </fieldset>
  );
}
