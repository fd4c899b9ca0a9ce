import { Alert, Button, FileButton, Group, Loader, NumberInput, Select, Text, Title } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import "../exchange/exchange.css";

import { api } from "../api/client";
import {
  followJob,
  type MapEdit,
  mapEdits,
  mendMap,
  placeAt,
  type PlaceInfo,
  renewMap,
  tryEdit,
} from "../api/maps";
import type { ConversionReport } from "../api/types";
import { lengthText, toShown, fromShown, unitFor } from "../language/units";
import { laneKind } from "../editor/placeWords";
import { served } from "../language/served";
import type { PackedDrawing } from "../map/drawing";
import { forgetMaps, type LoadedGraph, loadDrawing, loadGraph } from "../map/loaded";
import { MapCanvas, type Pointed } from "../map/MapCanvas";
import { EMPTY_SCENE, type Scene } from "../map/scene";
import { go, hashOf } from "../ui/address";
import { IconRedo, IconUndo } from "../ui/icons";
import { tellError } from "../ui/notices";
import { useLoaded } from "../ui/useLoaded";
import { type Placing, PictureForm } from "./PictureForm";
import { type Aim, aimWords, editWords, laneTypes, markWords, partWords, signWords } from "./words";

type Mark = Extract<MapEdit, { kind: "road_mark" }>["mark"];
type Row = ConversionReport["entries"][number];

interface Whole {
  edits: MapEdit[];
  rows: Row[];
  drawing: PackedDrawing;
  loaded: LoadedGraph;
}

/** A place that was chosen, and what is there. */
interface Chosen {
  x: number;
  y: number;
  info: PlaceInfo;
}

async function everything(map: string): Promise<Whole> {
  const [{ edits, rows }, drawing, loaded] = await Promise.all([
    mapEdits(map),
    loadDrawing(map),
    loadGraph(map),
  ]);
  return { edits, rows, drawing, loaded };
}

/** A map is looked at and mended: a place is chosen, and what is wrong there changed. */
export function MendView({ map }: { map: string }) {
  const { value, error, reload } = useLoaded(useCallback(() => everything(map), [map]));
  if (error)
    return (
      <div className="catalogue">
        <Alert color="red" title={t`The map cannot be shown`}>
          {error}
        </Alert>
        <Button mt="md" component="a" href={hashOf({ view: "catalogue" })}>
          <Trans>Back to the maps</Trans>
        </Button>
      </div>
    );
  if (!value)
    return (
      <div className="empty">
        <Loader aria-label={t`Loading the map`} />
      </div>
    );
  return <Bench map={map} whole={value} reload={reload} />;
}

/** A free name for the mended copy of a map. */
async function copyName(map: string): Promise<string> {
  const taken = new Set((await api.maps()).map(({ name }) => name));
  let name = `${map}-mended`;
  for (let n = 2; taken.has(name); n++) name = `${map}-mended-${n}`;
  return name;
}

function Bench({ map, whole, reload }: { map: string; whole: Whole; reload: () => void }) {
  const { edits, rows, drawing, loaded } = whole;
  const unfit = rows.map((entry) => (entry.fate === "lost" ? entry.reason : null));
  const [chosen, setChosen] = useState<Chosen | null>(null);
  const [aiming, setAiming] = useState<Aim | null>(null);
  const [shown, setShown] = useState<number[][]>([]);
  const [undone, setUndone] = useState<MapEdit[]>([]);
  const [working, setWorking] = useState(false);
  const [placing, setPlacing] = useState<Placing | null>(null);

  const build = async (start: (out: string) => Promise<{ job: string }>, left: MapEdit[]): Promise<void> => {
    setWorking(true);
    setAiming(null);
    try {
      // Scenarios of a map that has no edits yet are not to lose it: its copy is mended.
      const out = edits.length === 0 && undone.length === 0 ? await copyName(map) : map;
      const { job } = await start(out);
      if (!(await followJob(job, () => undefined))) return;
      setUndone(left);
      forgetMaps();
      if (out !== map) go({ view: "mend", map: out });
      else reload();
    } catch (error) {
      tellError(error);
    } finally {
      setWorking(false);
    }
  };
  const send = (next: MapEdit[], left: MapEdit[]): Promise<void> =>
    build((out) => mendMap(map, next, out), left);
  const renew = (file: File): Promise<void> => build((out) => renewMap(map, file, out), undone);
  const asked = useRef(0);
  const look = useCallback(
    async (x: number, y: number): Promise<void> => {
      const turn = ++asked.current;
      const info = await placeAt(map, x, y).catch(() => null);
      if (turn === asked.current) setChosen(info && { x, y, info });
    },
    [map],
  );
  // What is there may be another thing now.
  const latest = useRef<Chosen | null>(null);
  useEffect(() => {
    latest.current = chosen;
  });
  useEffect(() => {
    if (latest.current) void look(latest.current.x, latest.current.y);
  }, [whole, look]);
  // What does not fit is said at once, and what changes shown before the map is built anew.
  const add = async (edit: MapEdit): Promise<void> => {
    setAiming(null);
    setWorking(true);
    try {
      const { row: entry, outlines } = await tryEdit(map, edit);
      if (entry.fate === "lost") {
        tellError(new Error(served(entry.reason)));
        return;
      }
      setShown(outlines);
      await send([...edits, edit], []);
    } catch (error) {
      tellError(error);
    } finally {
      setShown([]);
      setWorking(false);
    }
  };
  const undo = (): void => void send(edits.slice(0, -1), [...edits.slice(-1), ...undone]);
  const redo = (): void => void send([...edits, ...undone.slice(0, 1)], undone.slice(1));
  const pick = (at: Pointed): void => {
    if (placing) {
      placing.onMap(at.x, at.y);
    } else if (aiming && chosen) {
      if (working) return;
      const { x, y, info } = chosen;
      void add({ kind: aiming, at: { x, y, hdg: info.hdg }, to: { x: at.x, y: at.y } } as MapEdit);
    } else {
      // Nothing is changed at the place before while this one is asked for.
      setChosen(null);
      void look(at.x, at.y);
    }
  };
  const scene = useMemo<Scene>(
    () => ({
      ...EMPTY_SCENE,
      nodes: { vehicles: false, walks: false, inside: null },
      lanes: [...(chosen ? [chosen.info.ring] : []), ...shown].map((ring) => new Float64Array(ring)),
      pins: [
        ...(chosen ? [{ x: chosen.x, y: chosen.y, sign: "+", text: lengthText(chosen.info.width, 2) }] : []),
        ...(placing?.pins ?? []),
      ],
    }),
    [chosen, placing, shown],
  );
  return (
    <div
      className="import"
      onKeyDown={(event) => {
        if (!(event.ctrlKey || event.metaKey) || working || event.target instanceof HTMLInputElement) return;
        const key = event.key.toLowerCase();
        const again = key === "y" || (key === "z" && event.shiftKey);
        if (again && undone.length > 0) redo();
        else if (key === "z" && !event.shiftKey && edits.length > 0) undo();
        else return;
        event.preventDefault();
      }}
    >
      <section className="import-side" aria-label={t`Mend the map`}>
        <Title order={1} size="h4" style={{ overflowWrap: "anywhere" }}>
          <Trans>Mend {map}</Trans>
        </Title>
        <Group my="sm" gap={6}>
          <Button
            size="compact-sm"
            variant="default"
            leftSection={<IconUndo />}
            disabled={working || edits.length === 0}
            onClick={undo}
          >
            <Trans>Undo</Trans>
          </Button>
          <Button
            size="compact-sm"
            variant="default"
            leftSection={<IconRedo />}
            disabled={working || undone.length === 0}
            onClick={redo}
          >
            <Trans>Redo</Trans>
          </Button>
          <Button size="compact-sm" variant="subtle" component="a" href={hashOf({ view: "catalogue" })}>
            <Trans>Back to the maps</Trans>
          </Button>
        </Group>
        <div role="status">
          {working && (
            <Group gap={8} mb="sm">
              <Loader size="xs" />
              <Text size="sm">
                <Trans>The map is being built anew …</Trans>
              </Text>
            </Group>
          )}
        </div>
        {aiming && (
          <Alert mb="sm">
            {aimWords(aiming)}{" "}
            <Button size="compact-sm" variant="white" onClick={() => setAiming(null)}>
              <Trans>Cancel</Trans>
            </Button>
          </Alert>
        )}
        {chosen ? (
          <PlaceForm
            key={`${chosen.x} ${chosen.y} ${chosen.info.width} ${chosen.info.limit}`}
            chosen={chosen}
            working={working}
            onAdd={(edit) => void add(edit)}
            onAim={setAiming}
          />
        ) : (
          <Text c="dimmed">
            <Trans>Choose a place on the map to change what is there.</Trans>
          </Text>
        )}
        <Title order={2} size="h5" mt="lg">
          <Trans>Changes</Trans>
        </Title>
        {edits.length === 0 ? (
          <Text size="sm" c="dimmed">
            <Trans>None yet. The first one makes a copy of the map, so that its scenarios keep it.</Trans>
          </Text>
        ) : (
          <ol aria-label={t`Changes`} style={{ margin: "6px 0", paddingLeft: 22 }}>
            {edits.map((edit, number) => (
              <li key={number}>
                {editWords(edit)}
                {unfit[number] && (
                  <Text span size="sm" c="red">
                    {" "}
                    <Trans>Does not fit: {served(unfit[number])}</Trans>
                  </Text>
                )}
              </li>
            ))}
          </ol>
        )}
        <Title order={2} size="h5" mt="lg">
          <Trans>Newer file of the place</Trans>
        </Title>
        <Text size="sm" c="dimmed" mb={6}>
          <Trans>It is imported in place of the one before, and all changes are made again.</Trans>
        </Text>
        <FileButton onChange={(file) => file && void renew(file)}>
          {(props) => (
            <Button size="compact-sm" variant="default" disabled={working} {...props}>
              <Trans>Choose a newer file</Trans>
            </Button>
          )}
        </FileButton>
        <PictureForm map={map} onPlacing={setPlacing} />
      </section>
      <div className="import-map">
        <MapCanvas
          drawing={drawing}
          map={map}
          graph={loaded.graph}
          picker={loaded.picker}
          scene={scene}
          label={t`Map ${map}`}
          aim
          onPick={pick}
        />
      </div>
    </div>
  );
}

/** What can be changed at the place that was chosen. */
function PlaceForm({
  chosen: { x, y, info },
  working,
  onAdd,
  onAim,
}: {
  chosen: Chosen;
  working: boolean;
  onAdd: (edit: MapEdit) => void;
  onAim: (kind: Aim) => void;
}) {
  const [width, setWidth] = useState<string | number>(Number(toShown(info.width, "length").toFixed(2)));
  const limited = info.limit === null ? "" : Math.round(toShown(info.limit / 3.6, "speed"));
  const [limit, setLimit] = useState<string | number>(limited);
  const at = { x, y, hdg: info.hdg };
  const button = (label: string, edit: MapEdit) => (
    <Button key={label} size="compact-sm" variant="default" disabled={working} onClick={() => onAdd(edit)}>
      {label}
    </Button>
  );
  // A limit has the number that is entered above, else the usual one of a town.
  const signEdit = (type: string): MapEdit =>
    type === "274"
      ? {
          kind: "add_sign",
          at,
          type,
          value: Math.round(limit === "" ? 50 : fromShown(Number(limit), "speed") * 3.6),
          unit: "km/h",
        }
      : { kind: "add_sign", at, type };
  const removals: Record<PlaceInfo["parts"][number], MapEdit> = {
    stop_line: { kind: "remove_stop_line", at: { x, y } },
    crosswalk: { kind: "remove_crosswalk", at: { x, y } },
    light: { kind: "remove_light", at: { x, y } },
    sign: { kind: "remove_sign", at: { x, y } },
    island: { kind: "remove_island", at: { x, y } },
    object: { kind: "remove_object", at: { x, y } },
  };
  const aim = (label: string, kind: Aim) => (
    <Button key={label} size="compact-sm" variant="default" disabled={working} onClick={() => onAim(kind)}>
      {label}
    </Button>
  );
  return (
    <>
      <Title order={2} size="h5">
        <Trans>
          {laneKind(info.type)}: {info.road}
        </Trans>
      </Title>
      <Text size="sm" c="dimmed" mb={6}>
        <Trans>{lengthText(info.width, 2)} wide here</Trans>
      </Text>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          onAdd({ kind: "lane_width", at, width: fromShown(Number(width), "length") });
        }}
      >
        <Group align="end" gap={6} mb={6}>
          <NumberInput
            label={t`Lane width, ${unitFor("length").sign}`}
            value={width}
            onChange={setWidth}
            min={toShown(0.5, "length")}
            max={toShown(20, "length")}
            step={0.25}
            decimalScale={2}
            w={150}
          />
          <Button type="submit" variant="default" disabled={working || width === ""}>
            <Trans>Change width</Trans>
          </Button>
        </Group>
      </form>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          onAdd({ kind: "speed_limit", at, limit: fromShown(Number(limit), "speed") * 3.6 });
        }}
      >
        <Group align="end" gap={6} mb="sm">
          <NumberInput
            label={t`Speed limit, ${unitFor("speed").sign}`}
            value={limit}
            onChange={setLimit}
            min={1}
            max={toShown(300 / 3.6, "speed")}
            step={10}
            w={150}
          />
          <Button type="submit" variant="default" disabled={working || limit === ""}>
            <Trans>Change limit</Trans>
          </Button>
        </Group>
      </form>
      <Group gap={6} role="group" aria-label={t`Add and remove`}>
        {info.parts.map((part) => button(t`Remove ${partWords()[part]}`, removals[part]))}
        {button(t`Add crosswalk`, { kind: "add_crosswalk", at })}
        {button(t`Add stop line`, { kind: "add_stop_line", at })}
        {button(t`Add traffic light`, { kind: "add_light", at })}
        {button(t`Add island`, { kind: "add_island", at })}
        {aim(t`Add turn …`, "add_turn")}
        {aim(t`Remove turn …`, "remove_turn")}
      </Group>
      <Group gap={6} mt={6} role="group" aria-label={t`Move and bend`}>
        {aim(t`Bend lane border …`, "bend_border")}
        {aim(t`Bend road …`, "bend_road")}
        {aim(t`Move end of road …`, "move_road_end")}
        {aim(t`Join junctions …`, "join_junctions")}
        {info.parts.map((part) => aim(t`Move ${partWords()[part]} …`, `move_${part}`))}
      </Group>
      <Group gap={6} mt={6} mb="sm" align="end" role="group" aria-label={t`Sign, use and road mark`}>
        <Select
          label={t`Add sign`}
          placeholder={t`Choose`}
          w={150}
          value={null}
          disabled={working}
          data={Object.entries(signWords()).map(([value, label]) => ({ value, label }))}
          onChange={(type) => type && onAdd(signEdit(type))}
        />
        <Select
          label={t`Lane for`}
          w={150}
          value={info.type}
          disabled={working}
          data={[...new Set([info.type, ...laneTypes])].map((type) => ({
            value: type,
            label: laneKind(type),
          }))}
          onChange={(type) => type && type !== info.type && onAdd({ kind: "access", at, type })}
        />
        <Select
          label={t`Road mark of the nearest border`}
          placeholder={t`Choose`}
          w={230}
          value={null}
          disabled={working}
          data={Object.entries(markWords()).map(([value, label]) => ({ value, label }))}
          onChange={(mark) => mark && onAdd({ kind: "road_mark", at, mark: mark as Mark })}
        />
      </Group>
    </>
  );
}
