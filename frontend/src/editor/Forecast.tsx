import { i18n } from "@lingui/core";
import { Alert, Button, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import { useEffect, useRef, useState } from "react";

import { type Forecast as Found, runs, type RunWish } from "../api/runs";
import { reasonOf } from "../ui/reason";
import { bytes } from "../ui/words";

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
        <Trans>Estimate disk and memory</Trans>
      </Button>
      {failure && (
        <Alert color="red" title={t`The estimate failed`}>
          {failure}
        </Alert>
      )}
      {found && (
        <Alert
          ref={answer}
          color={found.disk > found.free ? "red" : "blue"}
          role="status"
          title={found.disk > found.free ? t`Not enough disk space` : t`Estimate`}
        >
          <Text size="sm">
            <Trans>
              <Plural value={found.planned} one="# road user" other="# road users" /> in total,{" "}
              {found.running.toLocaleString(i18n.locale)} on the road at the same time.
            </Trans>
          </Text>
          <Text size="sm">
            <Trans>
              {bytes(found.disk)} of disk ({bytes(found.free)} free) and {bytes(found.memory)} of memory.
            </Trans>
          </Text>
        </Alert>
      )}
    </>
  );
}
