import { ActionIcon, Button, Card, Group, Text, Title, Tooltip } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { lazy, Suspense } from "react";
import type { MapInfo } from "../api/types";
import { hashOf } from "../ui/address";
import { IconTrash } from "../ui/icons";
import { mapFacts, networkFact } from "../ui/words";
import { lossWords } from "./losses";

/** What draws maps comes once there is one. */
const Preview = lazy(async () => ({ default: (await import("./Preview")).Preview }));

/** A map with its picture and what there is in it. */
export function MapCard({
  map,
  starting,
  onStart,
  onRemove,
  onReport,
}: {
  map: MapInfo;
  starting: boolean;
  onStart: () => void;
  onRemove: () => void;
  onReport: () => void;
}) {
  const facts = [...mapFacts(map.statistics), ...networkFact(map.network)];
  return (
    <Card withBorder padding={0} className="card">
      <Suspense fallback={<div className="card-picture" />}>
        <Preview name={map.name} picture={map.preview} />
      </Suspense>
      <div style={{ padding: "12px 16px 14px", display: "flex", flexDirection: "column", flex: 1 }}>
        <Group justify="space-between" wrap="nowrap">
          <Title order={2} size="h4" style={{ overflowWrap: "anywhere" }}>
            {map.name}
          </Title>
          <Tooltip label={t`Remove ${map.name}`}>
            <ActionIcon variant="subtle" color="gray" aria-label={t`Remove ${map.name}`} onClick={onRemove}>
              <IconTrash />
            </ActionIcon>
          </Tooltip>
        </Group>
        <ul className="card-facts" style={{ flex: 1, alignContent: "flex-start" }}>
          {facts.map((fact) => (
            <li key={fact}>{fact}</li>
          ))}
        </ul>
        {Object.keys(map.lost).length > 0 && (
          <Text size="sm" c="dimmed" mb={8}>
            <Trans>Lost for traffic: {lossWords(map.lost).join(", ")}</Trans>
          </Text>
        )}
        {Object.keys(map.guessed).length > 0 && (
          <Text size="sm" c="dimmed" mb={8}>
            <Trans>Guessed: {lossWords(map.guessed).join(", ")}</Trans>
          </Text>
        )}
        {map.outdated && (
          <Text size="sm" c="dimmed" mb={8}>
            <Trans>Built by an earlier odscen: it is rebuilt when it is first opened.</Trans>
          </Text>
        )}
        <Button fullWidth onClick={onStart} loading={starting} aria-label={t`New scenario on ${map.name}`}>
          <Trans>New scenario</Trans>
        </Button>
        <Button
          fullWidth
          mt={6}
          variant="subtle"
          size="compact-sm"
          onClick={onReport}
          aria-label={t`Import report of ${map.name}`}
        >
          <Trans>Import report</Trans>
        </Button>
        <Button
          fullWidth
          variant="subtle"
          size="compact-sm"
          component="a"
          href={hashOf({ view: "mend", map: map.name })}
          aria-label={t`Mend the map ${map.name}`}
        >
          <Trans>Mend the map</Trans>
        </Button>
      </div>
    </Card>
  );
}
