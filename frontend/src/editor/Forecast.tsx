import { Alert, Button, Text } from "@mantine/core";
import { useEffect, useRef, useState } from "react";

import { type Forecast as Found, runs, type RunWish } from "../api/runs";
import { reasonOf } from "../ui/reason";
import { bytes, count } from "../ui/words";

/** What the run will need; asked for on demand, as it takes as long as preparing a run. */
export function Forecast({ wish, version }: { wish: RunWish; version: number }) {
  const [busy, setBusy] = useState(false);
  const [found, setFound] = useState<Found | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  const { scenario, trajectories, every } = wish;
  // An estimate holds for what was asked.
  useEffect(() => {
    setFound(null);
    setFailure(null);
  }, [scenario, version, trajectories, every]);
  const answer = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (found) answer.current?.scrollIntoView({ block: "nearest" });
  }, [found]);
  const ask = (): void => {
    setBusy(true);
    setFailure(null);
    runs
      .forecast({ scenario, trajectories, every })
      .then(setFound, (error: unknown) => setFailure(reasonOf(error)))
      .finally(() => setBusy(false));
  };
  return (
    <>
      <Button variant="default" loading={busy} onClick={ask}>
        Estimate disk and memory
      </Button>
      {failure && (
        <Alert color="red" title="The estimate failed">
          {failure}
        </Alert>
      )}
      {found && (
        <Alert
          ref={answer}
          color={found.disk > found.free ? "red" : "blue"}
          role="status"
          title={found.disk > found.free ? "Not enough disk space" : "Estimate"}
        >
          <Text size="sm">
            {count(found.planned, "road user")} in total, {found.running.toLocaleString("en")} on the road at
            the same time.
          </Text>
          <Text size="sm">
            {bytes(found.disk)} of disk ({bytes(found.free)} free) and {bytes(found.memory)} of memory.
          </Text>
        </Alert>
      )}
    </>
  );
}
