import { Alert, Button, Card, Group, Modal, NumberInput, Select, Stack, Text, Title } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useEffect, useState } from "react";

import { shownUnit } from "../language/units";
import { served } from "../language/served";
import { type Template, templates } from "../api/templates";
import type { MapInfo } from "../api/types";
import { go } from "../ui/address";
import { reasonOf } from "../ui/reason";
import { useLoaded } from "../ui/useLoaded";

/** A gallery of scenes; one is placed on any map that has room for it. */
export function Templates({ maps }: { maps: MapInfo[] }) {
  const offered = useLoaded(templates.all);
  const [chosen, setChosen] = useState<Template | null>(null);
  if (!offered.value || maps.length === 0) return null;
  return (
    <section aria-labelledby="templates" style={{ marginTop: 34 }}>
      <Title order={2} size="h3" id="templates">
        <Trans>Start from a template</Trans>
      </Title>
      <Text c="dimmed" mb="sm">
        <Trans>Scenes with a story, placed on a map that has room for them.</Trans>
      </Text>
      <ul className="cards" aria-labelledby="templates">
        {offered.value.map((one) => (
          <li key={one.name}>
            <Card withBorder padding={0} className="card">
              <img
                className="card-picture"
                style={{ height: "auto" }}
                src={`templates/${one.name}.svg`}
                alt=""
                loading="lazy"
              />
              <div style={{ padding: "12px 16px 14px", display: "flex", flexDirection: "column", flex: 1 }}>
                <Title order={3} size="h4">
                  {served(one.title)}
                </Title>
                <Text size="sm" mt={4} mb="sm" style={{ flex: 1 }}>
                  {served(one.summary)}
                </Text>
                <Button
                  fullWidth
                  variant="default"
                  onClick={() => setChosen(one)}
                  aria-label={t`Place on a map: ${served(one.title)}`}
                >
                  <Trans>Place on a map</Trans>
                </Button>
              </div>
            </Card>
          </li>
        ))}
      </ul>
      <Modal
        opened={chosen !== null}
        onClose={() => setChosen(null)}
        title={chosen && served(chosen.title)}
        size="lg"
      >
        {chosen && <Placing key={chosen.name} template={chosen} maps={maps} />}
      </Modal>
    </section>
  );
}

/** Milliseconds after the last change of a number until maps are asked for room. */
const CALM = 300;

/**
 * Why each map has no room for a template with these numbers, empty where it has; asked for one map
 * after the other, as a large one takes seconds.
 */
function useRooms(
  template: string,
  maps: readonly MapInfo[],
  values: Record<string, number>,
): ReadonlyMap<string, string> {
  const [rooms, setRooms] = useState<ReadonlyMap<string, string>>(new Map());
  useEffect(() => {
    let current = true;
    setRooms(new Map());
    const ask = async (): Promise<void> => {
      for (const { name } of maps) {
        const reason = await templates.room(template, name, values).catch(() => null);
        if (!current) return;
        if (reason !== null) setRooms((known) => new Map(known).set(name, reason));
      }
    };
    const timer = setTimeout(() => void ask(), CALM);
    return () => {
      current = false;
      clearTimeout(timer);
    };
  }, [template, maps, values]);
  return rooms;
}

/** The maps in groups: those with room first, those that are not known yet, and those without. */
function mapChoices(
  maps: readonly MapInfo[],
  rooms: ReadonlyMap<string, string>,
): { group: string; items: string[] }[] {
  const named = (of: (reason: string | undefined) => boolean): string[] =>
    maps.map(({ name }) => name).filter((name) => of(rooms.get(name)));
  return [
    { group: t`With room for it`, items: named((reason) => reason === "") },
    { group: t`Not checked yet`, items: named((reason) => reason === undefined) },
    { group: t`Without a suitable location`, items: named((reason) => Boolean(reason)) },
  ].filter(({ items }) => items.length > 0);
}

/** Which map, and the numbers of a template. */
function Placing({ template, maps }: { template: Template; maps: MapInfo[] }) {
  const [map, setMap] = useState<string | null>(null);
  const [values, setValues] = useState<Record<string, number>>({});
  const [busy, setBusy] = useState(false);
  const [refused, setRefused] = useState<string | null>(null);
  const rooms = useRooms(template.name, maps, values);
  const reason = refused ?? (map === null ? "" : (rooms.get(map) ?? ""));
  const place = (): void => {
    if (map === null) return;
    setBusy(true);
    setRefused(null);
    templates.place(template.name, map, values).then(
      (made) => go({ view: "editor", scenario: made.name }),
      (error: unknown) => {
        setBusy(false);
        setRefused(reasonOf(error));
      },
    );
  };
  const change = (name: string, value: string | number): void => {
    setRefused(null);
    const others = Object.fromEntries(Object.entries(values).filter(([other]) => other !== name));
    setValues(typeof value === "number" ? { ...others, [name]: value } : others);
  };
  return (
    <Stack gap="sm">
      <Text size="sm">
        <Trans>
          {served(template.summary)} It needs {served(template.needs)}.
        </Trans>
      </Text>
      <Text size="xs" c="dimmed">
        {template.source}
      </Text>
      <Select
        label={t`Map`}
        placeholder={t`Choose a map`}
        searchable
        data={mapChoices(maps, rooms)}
        value={map}
        onChange={(next) => {
          setMap(next);
          setRefused(null);
        }}
      />
      <div style={{ display: "grid", gap: 12, gridTemplateColumns: "1fr 1fr", alignItems: "end" }}>
        {template.numbers.map((one) => {
          const { sign, shown, kept } = shownUnit(one.unit);
          const bound = (end: number | null): number | undefined => (end === null ? undefined : shown(end));
          return (
            <NumberInput
              key={one.name}
              label={sign ? `${served(one.title)} (${sign})` : served(one.title)}
              description={served(one.meaning)}
              placeholder={t`calculated`}
              min={bound(one.low)}
              max={bound(one.high)}
              decimalScale={3}
              defaultValue={bound(one.usual) ?? ""}
              onChange={(value) => change(one.name, typeof value === "number" ? kept(value) : value)}
            />
          );
        })}
      </div>
      {reason && (
        <Alert color="red" title={t`No suitable location`}>
          {reason}
        </Alert>
      )}
      <Group justify="flex-end">
        <Button onClick={place} loading={busy} disabled={map === null}>
          <Trans>Create scenario</Trans>
        </Button>
      </Group>
    </Stack>
  );
}
