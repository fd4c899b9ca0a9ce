import {
  ActionIcon, Alert, Badge, Button, Card, Group, Loader, Modal, Select, Table, Text, TextInput, Title,
  Tooltip,
} from "@mantine/core";
import { useState } from "react";

import { api } from "../api/client";
import type { MapInfo, ScenarioEntry } from "../api/types";
import { forgetMaps } from "../map/loaded";
import { IconSearch, IconTrash } from "../ui/icons";
import { tell, tellError } from "../ui/notices";
import { go, hashOf } from "../ui/route";
import { useLoaded } from "../ui/useLoaded";
import { count, mapFacts } from "../ui/words";
import { AddMap } from "./AddMap";
import { Preview } from "./Preview";
import { arranged, type Order, ORDERS } from "./order";

/** The first screen: choose a map, or go on with a scenario. */
export function CatalogueView() {
  const maps = useLoaded(api.maps);
  const scenarios = useLoaded(api.scenarios);
  const [search, setSearch] = useState("");
  const [order, setOrder] = useState<Order>("name");
  const [removing, setRemoving] = useState<{ what: "map" | "scenario"; name: string } | null>(null);
  const [starting, setStarting] = useState<string | null>(null);

  const start = (map: MapInfo): void => {
    setStarting(map.name);
    api.newScenario(map.name).then(
      (made) => go({ view: "editor", scenario: made.name }),
      (error: unknown) => { tellError(error); setStarting(null); },
    );
  };
  const remove = (): void => {
    if (!removing) return;
    const { what, name } = removing;
    setRemoving(null);
    (what === "map" ? api.removeMap(name) : api.removeScenario(name)).then(
      () => { tell(`${name} is removed.`); if (what === "map") forgetMaps(); maps.reload(); scenarios.reload(); },
      tellError,
    );
  };
  const found = arranged(maps.value ?? [], search, order);

  return (
    <div className="catalogue">
      <Title order={1} size="h2">Choose a map</Title>
      <Text c="dimmed">Pick where your traffic scenario takes place. You can look at every map before you decide.</Text>
      {maps.error && <Alert color="red" my="md" title="The maps cannot be shown">{maps.error}
        <Button ml="md" size="compact-sm" variant="white" onClick={maps.reload}>Try again</Button></Alert>}
      {!maps.value && !maps.error && <Loader my="xl" aria-label="Loading the maps" />}
      {maps.value && maps.value.length > 0 && (
        <div className="bar">
          <TextInput label="Search" placeholder="Part of the name" leftSection={<IconSearch />} value={search}
            onChange={(event) => setSearch(event.currentTarget.value)} />
          <Select label="Sort by" data={ORDERS} value={order} allowDeselect={false}
            onChange={(value) => setOrder((value ?? "name") as Order)} />
          <Text size="sm" c="dimmed" pb={8} role="status">{count(found.length, "map")}</Text>
        </div>
      )}
      {maps.value?.length === 0 && (
        <div className="empty">
          <Title order={2} size="h3">No maps yet</Title>
          <Text c="dimmed" mt={6}>Add one below: every map in the OpenDRIVE format will do.</Text>
        </div>
      )}
      {maps.value && maps.value.length > 0 && found.length === 0 && (
        <Text my="xl">No map has “{search}” in its name. <Button variant="subtle" size="compact-sm" onClick={() => setSearch("")}>Show all maps</Button></Text>
      )}
      <ul className="cards" aria-label="Maps">
        {found.map((map) => (
          <li key={map.name}>
            <Card withBorder padding={0} className="card">
              <Preview name={map.name} picture={map.preview} />
              <div style={{ padding: "12px 16px 14px", display: "flex", flexDirection: "column", flex: 1 }}>
                <Group justify="space-between" wrap="nowrap">
                  <Title order={2} size="h4">{map.name}</Title>
                  <Tooltip label={`Remove ${map.name}`}>
                    <ActionIcon variant="subtle" color="gray" aria-label={`Remove ${map.name}`}
                      onClick={() => setRemoving({ what: "map", name: map.name })}><IconTrash /></ActionIcon>
                  </Tooltip>
                </Group>
                <ul className="card-facts" style={{ flex: 1, alignContent: "flex-start" }}>
                  {mapFacts(map.statistics).map((fact) => <li key={fact}>{fact}</li>)}
                </ul>
                <Button fullWidth onClick={() => start(map)} loading={starting === map.name}
                  aria-label={`New scenario on ${map.name}`}>New scenario here</Button>
              </div>
            </Card>
          </li>
        ))}
      </ul>
      <div style={{ marginTop: 22 }}>
        <AddMap onAdded={maps.reload} />
      </div>
      <Scenarios list={scenarios.value ?? []} onRemove={(name) => setRemoving({ what: "scenario", name })} />
      <Modal opened={removing !== null} onClose={() => setRemoving(null)} centered
        title={`Remove ${removing?.name ?? ""}?`}>
        <Text size="sm">{removing?.what === "map"
          ? "The map and what was prepared for it are deleted. Scenarios on it stay, but need it to run."
          : "The scenario is deleted. The results of its runs stay."}</Text>
        <Group justify="flex-end" mt="lg">
          <Button variant="default" data-autofocus onClick={() => setRemoving(null)}>Keep it</Button>
          <Button color="red" onClick={remove}>Remove</Button>
        </Group>
      </Modal>
    </div>
  );
}

function Scenarios({ list, onRemove }: { list: ScenarioEntry[]; onRemove: (name: string) => void }) {
  if (list.length === 0) return null;
  return (
    <section aria-labelledby="scenarios" style={{ marginTop: 34 }}>
      <Title order={2} size="h3" id="scenarios" mb="sm">Your scenarios</Title>
      <Table highlightOnHover verticalSpacing="xs">
        <Table.Thead>
          <Table.Tr><Table.Th>Name</Table.Th><Table.Th>Map</Table.Th><Table.Th>Road users</Table.Th>
            <Table.Th>Changed</Table.Th><Table.Th><span aria-label="Actions" /></Table.Th></Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {list.map((one) => (
            <Table.Tr key={one.name}>
              <Table.Td><a href={hashOf({ view: "editor", scenario: one.name })}>{one.title ?? one.name}</a>{one.error && <Text size="xs" c="red">{one.error}</Text>}</Table.Td>
              <Table.Td><Badge variant="default" tt="none">{one.map ?? "?"}</Badge></Table.Td>
              <Table.Td>{one.actors}</Table.Td>
              <Table.Td>{when(one.modified)}</Table.Td>
              <Table.Td ta="right">
                <ActionIcon variant="subtle" color="gray" aria-label={`Remove ${one.name}`} onClick={() => onRemove(one.name)}><IconTrash /></ActionIcon>
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </section>
  );
}

function when(modified: number): string {
  return new Date(modified * 1000).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "short" });
}
