import { Text, Title } from "@mantine/core";
import { useCallback } from "react";

import { type EgoOutcome, runs } from "../api/runs";
import { useLoaded } from "../ui/useLoaded";
import { count, kmh } from "../ui/words";

const STATUS: Record<EgoOutcome["status"], string> = {
  arrived: "reached its goal",
  running: "was still on its way at the end",
  waiting: "was not inserted",
  stranded: "was stranded: every route to its goal was closed",
};

/** What became of the vehicles under test, a sentence each; nothing of a run without any. */
export function Egos({ run }: { run: string }) {
  const { value } = useLoaded(useCallback(() => runs.egos(run), [run]));
  if (!value || value.egos.length === 0) return null;
  return (
    <section aria-label="Ego" style={{ marginTop: 14 }}>
      <Title order={3} size="h5">
        Ego
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
    ...(time === null ? [] : [`in ${time.toFixed(1)} s`]),
    ...(delay === null ? [] : [`${delay.toFixed(1)} s of it delay`]),
    ...(speed === null ? [] : [`${kmh(speed)} on average`]),
  ];
  const wrong = [
    ...(ego.collisions > 0 ? [count(ego.collisions, "collision")] : []),
    ...(ego.emergency_stops > 0
      ? [count(ego.emergency_stops, "emergency braking", "emergency brakings")]
      : []),
    ...(ego.teleports > 0 ? [count(ego.teleports, "teleport")] : []),
  ];
  return `${id} ${[STATUS[status], ...facts].join(", ")}: ${wrong.length > 0 ? wrong.join(", ") : "no incident"}.`;
}
