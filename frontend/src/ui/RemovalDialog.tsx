import { Alert, Button, Group, Loader, Modal, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useEffect, useState } from "react";

import { type Facts, type Kind, removal } from "../api/removal";
import { tell, tellError } from "./notices";
import { reasonOf } from "./reason";
import { factsWords } from "./removalWords";

/** What is to be removed. */
export interface ToRemove {
  kind: Kind;
  name: string;
}

/** Asks before something is removed, with what depends on it; the notice after that can undo it. */
export function RemovalDialog({
  what,
  onClose,
  onChanged,
}: {
  what: ToRemove | null;
  onClose: () => void;
  /** It has gone, or come back. */
  onChanged: (what: ToRemove, there: boolean) => void;
}) {
  const [facts, setFacts] = useState<Facts | null>(null);
  const [error, setError] = useState<string | null>(null);
  useEffect(() => {
    let current = true;
    setFacts(null);
    setError(null);
    if (what)
      removal.facts(what.kind, what.name).then(
        (found) => {
          if (current) setFacts(found);
        },
        (reason: unknown) => {
          if (current) setError(reasonOf(reason));
        },
      );
    return () => {
      current = false;
    };
  }, [what]);
  const remove = (gone: ToRemove): void => {
    onClose();
    removal.remove(gone.kind, gone.name).then((item) => {
      const undo = (): void => {
        if (item) removal.restore(item.id).then(() => onChanged(gone, true), tellError);
      };
      tell(
        item ? t`${gone.name} is in the wastebasket.` : t`${gone.name} is removed.`,
        item ? { label: t`Undo`, run: undo } : undefined,
      );
      onChanged(gone, false);
    }, tellError);
  };
  const busy = what?.kind === "run" && facts?.live === 1;
  return (
    <Modal opened={what !== null} onClose={onClose} centered title={t`Remove ${what?.name ?? ""}?`}>
      {!facts && !error && <Loader size="sm" aria-label={t`Looking what depends on it`} />}
      {error && <Alert color="red">{error}</Alert>}
      {facts &&
        factsWords(facts).map((line) => (
          <Text size="sm" mb={6} key={line}>
            {line}
          </Text>
        ))}
      <Group justify="flex-end" mt="lg">
        <Button variant="default" data-autofocus onClick={onClose}>
          <Trans>Keep it</Trans>
        </Button>
        <Button
          color="red"
          disabled={!facts || busy}
          onClick={() => {
            if (what) remove(what);
          }}
        >
          <Trans>Remove</Trans>
        </Button>
      </Group>
    </Modal>
  );
}
