import { Button, Group, Modal, Text } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import type { ScenarioDocument } from "../api/types";
import type { AskedRemoval, Uses } from "./uses";

/** Asks before road users are removed that rules or criteria are about. */
export function RemoveUsed({
  asked: { ids, uses },
  document,
  onRemove,
  onClose,
}: {
  asked: AskedRemoval;
  document: Pick<ScenarioDocument, "criteria">;
  onRemove: (withUses: Uses) => void;
  onClose: () => void;
}) {
  const who =
    ids.length === 1 ? (ids[0] ?? "") : plural(ids.length, { one: "# road user", other: "# road users" });
  const take = (withUses: Uses): void => {
    onClose();
    onRemove(withUses);
  };
  return (
    <Modal opened onClose={onClose} centered title={t`Remove ${who}?`}>
      <Text size="sm">
        <Trans>These are about it, and do nothing without it:</Trans>
      </Text>
      <ul>
        {uses.rules.map((rule) => (
          <li key={rule}>
            <Trans>Rule {rule}</Trans>
          </li>
        ))}
        {uses.criteria.map((n) => (
          <li key={n}>
            <Trans>Criterion {document.criteria[n]}</Trans>
          </li>
        ))}
      </ul>
      <Group justify="flex-end" mt="lg">
        <Button variant="default" data-autofocus onClick={onClose}>
          <Trans>Cancel</Trans>
        </Button>
        <Button variant="default" onClick={() => take({ rules: [], criteria: [] })}>
          <Trans>Remove {who} only</Trans>
        </Button>
        <Button color="red" onClick={() => take(uses)}>
          <Trans>Remove all of these</Trans>
        </Button>
      </Group>
    </Modal>
  );
}
