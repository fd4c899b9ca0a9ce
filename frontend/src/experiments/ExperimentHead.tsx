import { Alert, Anchor, Button, Group, Modal, Progress, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type ReactNode, useState } from "react";

import { tellError } from "../ui/notices";

/** What can be done with an experiment. */
interface Actions {
  stop: () => Promise<unknown>;
  resume: () => Promise<unknown>;
  remove: () => Promise<unknown>;
}

/** Outcome or progress of a sweep or a study, and what can be done. */
export function ExperimentHead({
  name,
  state,
  share,
  error,
  elsewhere = false,
  words,
  actions,
  links,
  all,
  lost,
  onChanged,
  onRemoved,
  children,
}: {
  name: string;
  state: "running" | "done" | "stopped" | "failed";
  /** How much has ended, per cent. */
  share: number;
  error: string | null | undefined;
  /** Whether another process works on it, which this server cannot stop. */
  elsewhere?: boolean;
  words: { progress: string; failed: string; remove: string; all: string };
  actions: Actions;
  /** Files to take away. */
  links: ReactNode;
  /** Address of the list. */
  all: string;
  /** What is lost with it. */
  lost: ReactNode;
  onChanged: () => void;
  onRemoved: () => void;
  /** How far it is, in words. */
  children: ReactNode;
}) {
  const [asking, setAsking] = useState(false);
  const ask = (call: Promise<unknown>): void => {
    call.then(onChanged, tellError);
  };
  return (
    <>
      <Text role="status">{children}</Text>
      {state === "running" && (
        <Progress my="xs" size="lg" animated value={share} aria-label={words.progress} />
      )}
      {state === "failed" && (
        <Alert color="red" title={words.failed} my="xs">
          {error}
        </Alert>
      )}
      <Group my="sm">
        {state === "running" && !elsewhere && (
          <Button variant="default" onClick={() => ask(actions.stop())}>
            <Trans>Stop</Trans>
          </Button>
        )}
        {(state === "stopped" || state === "failed") && (
          <Button onClick={() => ask(actions.resume())}>
            <Trans>Resume</Trans>
          </Button>
        )}
        {links}
        {state !== "running" && (
          <Button variant="subtle" color="gray" onClick={() => setAsking(true)}>
            {words.remove}
          </Button>
        )}
        <Anchor href={all}>{words.all}</Anchor>
      </Group>
      <Modal opened={asking} onClose={() => setAsking(false)} title={t`Delete ${name}?`}>
        <Text size="sm" mb="md">
          {lost}
        </Text>
        <Group justify="flex-end">
          <Button variant="default" onClick={() => setAsking(false)}>
            <Trans>Keep it</Trans>
          </Button>
          <Button color="red" onClick={() => actions.remove().then(onRemoved, tellError)}>
            <Trans>Delete</Trans>
          </Button>
        </Group>
      </Modal>
    </>
  );
}
