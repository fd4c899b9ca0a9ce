import { Alert, Button, Group, Loader, Modal, Stack, Text, TextInput } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type FormEvent, useState } from "react";

import { api } from "../api/client";
import { scenarioLabels } from "../catalogue/titles";
import { nth } from "../lists";
import { go } from "../ui/address";
import { reasonOf } from "../ui/reason";
import { useLoaded } from "../ui/useLoaded";

/** Asks for a name; a name that the server refuses can be changed and tried again. */
export function NameDialog({
  title,
  label,
  value,
  action,
  onName,
  onClose,
}: {
  title: string;
  label: string;
  value: string;
  action: string;
  onName: (name: string) => Promise<void>;
  onClose: () => void;
}) {
  const [name, setName] = useState(value);
  const [busy, setBusy] = useState(false);
  const [failure, setFailure] = useState<string | null>(null);
  const submit = (event: FormEvent): void => {
    event.preventDefault();
    setBusy(true);
    setFailure(null);
    onName(name.trim())
      .catch((error: unknown) => setFailure(reasonOf(error)))
      .finally(() => setBusy(false));
  };
  return (
    <Modal opened onClose={onClose} title={title} centered>
      <form onSubmit={submit}>
        <TextInput
          data-autofocus
          label={label}
          value={name}
          error={failure}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <Group justify="flex-end" mt="md">
          <Button variant="default" onClick={onClose}>
            <Trans>Cancel</Trans>
          </Button>
          <Button type="submit" loading={busy} disabled={!name.trim()}>
            {action}
          </Button>
        </Group>
      </form>
    </Modal>
  );
}

/** All scenarios, those changed last first. */
export function OpenDialog({ current, onClose }: { current: string; onClose: () => void }) {
  const { value, error } = useLoaded(api.scenarios);
  const others = value?.filter((one) => one.name !== current && !one.error);
  const labels = scenarioLabels(others ?? []);
  return (
    <Modal opened onClose={onClose} title={t`Open another scenario`} centered>
      {error && <Alert color="red">{error}</Alert>}
      {!others && !error && <Loader aria-label={t`Loading the scenarios`} />}
      {others?.length === 0 && (
        <Text size="sm">
          <Trans>There is no other one yet. “Save as” makes a copy of this one.</Trans>
        </Text>
      )}
      <Stack gap={6}>
        {others?.map((one, n) => (
          <Button
            key={one.name}
            variant="default"
            justify="space-between"
            className="wrapping"
            onClick={() => go({ view: "editor", scenario: one.name })}
            rightSection={
              <Text size="xs" c="dimmed">
                {one.map}, {plural(one.actors, { one: "# road user", other: "# road users" })}
              </Text>
            }
          >
            {nth(labels, n)}
          </Button>
        ))}
      </Stack>
    </Modal>
  );
}
