import { Text, Title } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useCallback } from "react";

import { speedText } from "../language/units";
import { fixed } from "../language/numbers";
import { localized } from "../language/localized";
import { type EgoOutcome, runs } from "../api/runs";
import { useLoaded } from "../ui/useLoaded";

const STATUS = localized((): Record<EgoOutcome["status"], string> => ({
  arrived: t`reached its goal`,
  running: t`was still on its way at the end`,
  waiting: t`was not inserted`,
  stranded: t`was stranded: every route to its goal was closed`,
}));

/** What became of the vehicles under test, a sentence each; nothing of a run without any. */
export function Egos({ run }: { run: string }) {
  const { value } = useLoaded(useCallback(() => runs.egos(run), [run]));
  if (!value || value.egos.length === 0) return null;
  return (
    <section aria-label={t`Ego`} style={{ marginTop: 14 }}>
      <Title order={3} size="h5">
        <Trans>Ego</Trans>
      </Title>
      {value.egos.map((ego) => (
        <Text key={ego.id} size="sm" mt={4}>
          {sentence(ego)}
        </Text>
      ))}
    </section>
  );
}

function sentence(ego: EgoOutcome): string {
  const { id, status, travel_time: time, delay, mean_speed: speed } = ego;
  const facts = [
    ...(time === null ? [] : [t`in ${fixed(time, 1)} s`]),
    ...(delay === null ? [] : [t`${fixed(delay, 1)} s of it delay`]),
    ...(speed === null ? [] : [t`${speedText(speed)} on average`]),
  ];
  const wrong = [
    ...(ego.collisions > 0 ? [plural(ego.collisions, { one: "# collision", other: "# collisions" })] : []),
    ...(ego.emergency_stops > 0
      ? [plural(ego.emergency_stops, { one: "# emergency braking", other: "# emergency brakings" })]
      : []),
    ...(ego.teleports > 0 ? [plural(ego.teleports, { one: "# teleport", other: "# teleports" })] : []),
  ];
  return `${id} ${[STATUS()[status], ...facts].join(", ")}: ${wrong.length > 0 ? wrong.join(", ") : t`no incident`}.`;
}
