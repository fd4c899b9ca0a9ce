import { Alert, Button, Chip, Group, Loader, Select, Text, TextInput, Title } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type DragEvent, useState } from "react";

import { api } from "../api/client";
import { removal } from "../api/removal";
import type { MapInfo } from "../api/types";
import { formatOf } from "../exchange/formats";
import { isXosc, RECORDED, useImport } from "../exchange/useImport";
import { forgetMaps } from "../map/loaded";
import { IconSearch, IconTrash } from "../ui/icons";
import { tell, tellError } from "../ui/notices";
import { RemovalDialog, type ToRemove } from "../ui/RemovalDialog";
import { go } from "../ui/address";
import { useLoaded } from "../ui/useLoaded";
import { AddMap } from "./AddMap";
import { BrokenMaps } from "./BrokenMaps";
import { Conversion } from "./Conversion";
import { MapCard } from "./MapCard";
import { arranged, type Order, ORDERS, type Wish, WISHES } from "./order";
import { Recordings } from "./Recordings";
import { Scenarios } from "./Scenarios";
import { Templates } from "./Templates";
import { Wastebasket } from "./Wastebasket";

/** A scenario of CommonRoad has road users that move; its other files are maps. */
const hasObstacles = async (file: File): Promise<boolean> =>
  /\.xml$/i.test(file.name) && (await file.text()).includes("<dynamicObstacle");

async function formatOfDropped(files: readonly File[]): Promise<string | null> {
  const of = await formatOf(files);
  if (of !== null) return of;
  const moving = await Promise.all(files.map(hasObstacles));
  return moving.includes(true) ? RECORDED : null;
}

/** The first screen: choose a map, or open a scenario. */
export function CatalogueView() {
  const maps = useLoaded(api.maps);
  const scenarios = useLoaded(api.scenarios);
  const [search, setSearch] = useState("");
  const [order, setOrder] = useState<Order>("name");
  const [wishes, setWishes] = useState<Wish[]>([]);
  const broken = useLoaded(removal.brokenMaps);
  const [removing, setRemoving] = useState<ToRemove | null>(null);
  const [basket, setBasket] = useState(false);
  const [reported, setReported] = useState<string | null>(null);
  const [starting, setStarting] = useState<string | null>(null);
  const [over, setOver] = useState(false);
  const importing = useImport();

  const start = (map: MapInfo): void => {
    setStarting(map.name);
    api.newScenario(map.name).then(
      (made) => go({ view: "editor", scenario: made.name }),
      (error: unknown) => {
        tellError(error);
        setStarting(null);
      },
    );
  };
  const reload = (): void => {
    forgetMaps();
    maps.reload();
    broken.reload();
    scenarios.reload();
  };
  const dropped = (event: DragEvent): void => {
    event.preventDefault();
    setOver(false);
    const files = [...event.dataTransfer.files];
    if (files.some(isXosc)) importing.begin(files);
    else if (files.length > 0)
      formatOfDropped(files).then((of) => {
        if (of !== null) importing.begin(files, of);
        else tell(t`Maps (.xodr) go onto “Add a map of your own”, below the maps.`);
      }, tellError);
  };
  const all = maps.value ?? [];
  const found = arranged(all, search, order, wishes);
  const own = scenarios.value ?? [];
  // Who has begun something comes back for that.
  const mine = (
    <Scenarios
      list={own}
      importing={importing}
      onRemove={(name) => setRemoving({ kind: "scenario", name })}
    />
  );

  return (
    <div
      className="catalogue"
      data-over={over}
      onDragOver={(event) => {
        event.preventDefault();
        setOver(true);
      }}
      onDragLeave={(event) => {
        if (!event.currentTarget.contains(event.relatedTarget as Node | null)) setOver(false);
      }}
      onDrop={dropped}
    >
      {own.length > 0 && mine}
      <Title order={own.length > 0 ? 2 : 1} size={own.length > 0 ? "h3" : "h2"} mt={own.length > 0 ? 34 : 0}>
        <Trans>Choose a map</Trans>
      </Title>
      <Text c="dimmed">
        <Trans>
          Pick where your traffic scenario takes place. You can look at every map before you decide.
        </Trans>
      </Text>
      {maps.error && (
        <Alert color="red" my="md" title={t`The maps cannot be shown`}>
          {maps.error}
          <Button ml="md" size="compact-sm" variant="white" onClick={maps.reload}>
            <Trans>Try again</Trans>
          </Button>
        </Alert>
      )}
      <BrokenMaps list={broken.value ?? []} onRemove={(name) => setRemoving({ kind: "map", name })} />
      {!maps.value && !maps.error && <Loader my="xl" aria-label={t`Loading the maps`} />}
      {all.length > 0 && (
        <>
          <div className="bar">
            <TextInput
              label={t`Search`}
              placeholder={t`Part of the name`}
              leftSection={<IconSearch />}
              value={search}
              onChange={(event) => setSearch(event.currentTarget.value)}
            />
            <Select
              label={t`Sort by`}
              data={ORDERS()}
              value={order}
              allowDeselect={false}
              onChange={(value) => setOrder(ORDERS().find((one) => one.value === value)?.value ?? "name")}
            />
            <Text size="sm" c="dimmed" pb={8} role="status">
              {plural(found.length, { one: "# map", other: "# maps" })}
            </Text>
          </div>
          <Chip.Group
            multiple
            value={wishes}
            onChange={(chosen) =>
              setWishes(
                WISHES()
                  .map(({ value }) => value)
                  .filter((one) => chosen.includes(one)),
              )
            }
          >
            <Group gap={8} mb="md" role="group" aria-label={t`Only maps with`}>
              <Text size="sm" aria-hidden="true">
                <Trans>Only maps with</Trans>
              </Text>
              {WISHES().map(({ value, label }) => (
                <Chip key={value} value={value} size="sm" variant="outline">
                  {label}
                </Chip>
              ))}
            </Group>
          </Chip.Group>
        </>
      )}
      {all.length > 0 && found.length === 0 && (
        <Text my="xl">
          <Trans>
            No matching maps.{" "}
            <Button
              variant="subtle"
              size="compact-sm"
              onClick={() => {
                setSearch("");
                setWishes([]);
              }}
            >
              Show all maps
            </Button>
          </Trans>
        </Text>
      )}
      <ul className="cards" aria-label={t`Maps`}>
        {found.map((map) => (
          <li key={map.name}>
            <MapCard
              map={map}
              starting={starting === map.name}
              onStart={() => start(map)}
              onReport={() => setReported(map.name)}
              onRemove={() => setRemoving({ kind: "map", name: map.name })}
            />
          </li>
        ))}
      </ul>
      {maps.value && (
        <div style={{ marginTop: 22 }}>
          <AddMap empty={all.length === 0} onAdded={reload} onReport={setReported} />
        </div>
      )}
      <Templates maps={all} />
      {own.length === 0 && mine}
      <Recordings />
      <Button
        mt="xl"
        variant="subtle"
        color="gray"
        leftSection={<IconTrash />}
        onClick={() => setBasket(true)}
      >
        <Trans>Wastebasket</Trans>
      </Button>
      {basket && <Wastebasket onClose={() => setBasket(false)} onRestored={reload} />}
      {reported && <Conversion map={reported} onClose={() => setReported(null)} />}
      <RemovalDialog what={removing} onClose={() => setRemoving(null)} onChanged={reload} />
    </div>
  );
}
