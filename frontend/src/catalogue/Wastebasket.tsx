import { Alert, Button, Group, Loader, Modal, Table, Text, VisuallyHidden } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { localized } from "../language/localized";
import { type Kind, type Removed, removal } from "../api/removal";
import { when } from "../run/figures";
import { tell, tellError } from "../ui/notices";
import { useLoaded } from "../ui/useLoaded";
import { bytes } from "../ui/words";

const KIND_WORD = localized((): Record<Kind, string> => ({
  map: t`Map`,
  scenario: t`Scenario`,
  run: t`Run`,
}));

/** What was removed, to be restored or deleted for good. */
export function Wastebasket({ onClose, onRestored }: { onClose: () => void; onRestored: () => void }) {
  const { value, error, reload } = useLoaded(removal.trash);
  const [deleting, setDeleting] = useState<string | null>(null);
  const restore = (item: Removed): void => {
    removal.restore(item.id).then(() => {
      tell(t`${item.name} is back.`);
      reload();
      onRestored();
    }, tellError);
  };
  const deleteForGood = (item: Removed): void => {
    setDeleting(null);
    removal.deleteForGood(item.id).then(() => {
      tell(t`${item.name} is deleted.`);
      reload();
    }, tellError);
  };
  return (
    <Modal opened onClose={onClose} size="xl" title={t`Wastebasket`}>
      {error && <Alert color="red">{error}</Alert>}
      {!value && !error && <Loader aria-label={t`Loading the wastebasket`} />}
      {value?.length === 0 && (
        <Text c="dimmed">
          <Trans>The wastebasket is empty.</Trans>
        </Text>
      )}
      {value && value.length > 0 && (
        <Table verticalSpacing={6} fz={14} aria-label={t`Wastebasket`}>
          <Table.Thead>
            <Table.Tr>
              <Table.Th>
                <Trans>Name</Trans>
              </Table.Th>
              <Table.Th>
                <Trans>Kind</Trans>
              </Table.Th>
              <Table.Th>
                <Trans>Removed</Trans>
              </Table.Th>
              <Table.Th>
                <Trans>Kept until</Trans>
              </Table.Th>
              <Table.Th>
                <Trans>Size</Trans>
              </Table.Th>
              <Table.Th>
                <VisuallyHidden>
                  <Trans>Actions</Trans>
                </VisuallyHidden>
              </Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {value.map((item) => (
              <Table.Tr key={item.id}>
                <Table.Td style={{ overflowWrap: "anywhere", minWidth: 160 }}>{item.name}</Table.Td>
                <Table.Td>{KIND_WORD()[item.kind]}</Table.Td>
                <Table.Td>{when(item.removed)}</Table.Td>
                <Table.Td>{when(item.until)}</Table.Td>
                <Table.Td style={{ whiteSpace: "nowrap" }}>{bytes(item.size)}</Table.Td>
                <Table.Td>
                  <Group gap={6} justify="flex-end" wrap="nowrap">
                    {deleting === item.id ? (
                      <>
                        <Button
                          size="compact-sm"
                          variant="default"
                          data-autofocus
                          onClick={() => setDeleting(null)}
                        >
                          <Trans>Keep it</Trans>
                        </Button>
                        <Button
                          size="compact-sm"
                          color="red"
                          aria-label={t`Delete ${item.name} for good`}
                          onClick={() => deleteForGood(item)}
                        >
                          <Trans>Delete for good</Trans>
                        </Button>
                      </>
                    ) : (
                      <>
                        <Button
                          size="compact-sm"
                          variant="light"
                          aria-label={t`Restore ${item.name}`}
                          onClick={() => restore(item)}
                        >
                          <Trans>Restore</Trans>
                        </Button>
                        <Button
                          size="compact-sm"
                          variant="subtle"
                          color="red"
                          aria-label={t`Delete ${item.name}`}
                          onClick={() => setDeleting(item.id)}
                        >
                          <Trans>Delete</Trans>
                        </Button>
                      </>
                    )}
                  </Group>
                </Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      )}
    </Modal>
  );
}
