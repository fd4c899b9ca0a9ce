import { Alert, Button, Group, Text } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import type { BrokenMap } from "../api/removal";
import { served } from "../language/served";

/** Maps whose folders are damaged: what is wrong with each, and what can be done. */
export function BrokenMaps({ list, onRemove }: { list: BrokenMap[]; onRemove: (name: string) => void }) {
  if (list.length === 0) return null;
  const title = list.length === 1 ? t`A map is damaged` : t`${list.length} maps are damaged`;
  return (
    <Alert color="red" my="md" title={title}>
      <Text size="sm" mb={8}>
        <Trans>Add its file again to repair a map, or remove it. Other maps are not affected.</Trans>
      </Text>
      {list.map(({ name, problem }) => (
        <Group key={name} justify="space-between" wrap="nowrap" mt={6}>
          <Text size="sm" style={{ overflowWrap: "anywhere" }}>
            <b>{name}</b>: {served(problem)}
          </Text>
          <Button
            size="compact-sm"
            variant="default"
            aria-label={t`Remove ${name}`}
            style={{ flexShrink: 0 }}
            onClick={() => onRemove(name)}
          >
            <Trans>Remove</Trans>
          </Button>
        </Group>
      ))}
    </Alert>
  );
}
