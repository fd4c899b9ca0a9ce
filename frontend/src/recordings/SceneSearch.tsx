import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { Alert, Button, Group, Progress, Text } from "@mantine/core";
import { useEffect, useState } from "react";

import { api } from "../api/client";
import { recordings } from "../api/recordings";
import type { Job } from "../api/types";
import { served } from "../language/served";
import { reasonOf } from "../ui/reason";
import { sentence } from "../ui/words";

/** A large recording is shown before its scenes have been looked for; this says how far that is. */
export function SceneSearch({ recording, onSearched }: { recording: string; onSearched: () => void }) {
  const [job, setJob] = useState<Job | null>(null);
  const [ended, setEnded] = useState<string | null>(null);
  const [turn, setTurn] = useState(0);
  useEffect(() => {
    let current = true;
    const onStep = (next: Job): void => {
      if (current) setJob(next);
    };
    recordings.search(recording, onStep).then(
      (searched) => {
        if (!current) return;
        if (searched) onSearched();
        else setEnded(t`The search was cancelled.`);
      },
      (error: unknown) => {
        if (current) setEnded(reasonOf(error));
      },
    );
    return () => {
      current = false;
    };
  }, [recording, onSearched, turn]);
  if (ended !== null)
    return (
      <Alert color="orange" title={t`Scenes have not been found`} style={{ overflowWrap: "anywhere" }}>
        <Text size="sm" mb="xs">
          {ended}
        </Text>
        <Button
          size="compact-sm"
          onClick={() => {
            setEnded(null);
            setTurn((n) => n + 1);
          }}
        >
          <Trans>Look for them</Trans>
        </Button>
      </Alert>
    );
  return (
    <>
      <Text size="sm" role="status">
        {job === null ? t`Scenes are looked for.` : `${sentence(served(job.step))} …`}
      </Text>
      <Progress my="xs" value={100 * (job?.share ?? 0)} aria-label={t`Progress of the search for scenes`} />
      <Group>
        <Button
          size="compact-sm"
          variant="default"
          disabled={job === null}
          // Refused only when it has ended meanwhile, which the page learns by itself.
          onClick={() => job && void api.cancelJob(job.id).catch(() => undefined)}
        >
          <Trans>Cancel the search</Trans>
        </Button>
      </Group>
    </>
  );
}
