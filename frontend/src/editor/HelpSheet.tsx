import { Modal, Table, Tabs } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { SHORTCUTS } from "./keys";
import { TERMS } from "./terms";

/** Shortcuts of the keyboard, and the terms of the page explained. */
export function HelpSheet({ open, onClose }: { open: boolean; onClose: () => void }) {
  return (
    <Modal opened={open} onClose={onClose} title={t`Help`} centered size="lg">
      <Tabs defaultValue="keys">
        <Tabs.List>
          <Tabs.Tab value="keys">
            <Trans>Keyboard shortcuts</Trans>
          </Tabs.Tab>
          <Tabs.Tab value="terms">
            <Trans>Glossary</Trans>
          </Tabs.Tab>
        </Tabs.List>
        <Tabs.Panel value="keys">
          <Table aria-label={t`Keyboard shortcuts`}>
            <Table.Tbody>
              {SHORTCUTS().map(([key, what]) => (
                <Table.Tr key={key}>
                  <Table.Td>
                    <kbd>{key}</kbd>
                  </Table.Td>
                  <Table.Td>{what}</Table.Td>
                </Table.Tr>
              ))}
            </Table.Tbody>
          </Table>
        </Tabs.Panel>
        <Tabs.Panel value="terms">
          <dl className="terms" aria-label={t`Glossary`}>
            {TERMS().map(([term, meaning]) => (
              <div key={term}>
                <dt>{term}</dt>
                <dd>{meaning}</dd>
              </div>
            ))}
          </dl>
        </Tabs.Panel>
      </Tabs>
    </Modal>
  );
}
