import { plural, t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";

import "./exchange.css";

import { Alert, Anchor, Button, Group, Loader, Text, Title } from "@mantine/core";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import { lengthText } from "../language/units";
import { api } from "../api/client";
import { exchange, type ImportReport, type ImportRow } from "../api/exchange";
import type { Assets, ScenarioState } from "../api/types";
import { sceneActors } from "../editor/scene";
import type { PackedDrawing } from "../map/drawing";
import { type LoadedGraph, loadDrawing, loadGraph } from "../map/loaded";
import { MapCanvas, type MapHandle } from "../map/MapCanvas";
import { EMPTY_SCENE, type Scene } from "../map/scene";
import { go } from "../ui/address";
import { useLearnedTitle } from "../ui/titles";
import { useLoaded } from "../ui/useLoaded";
import { around, pinsOf, spotOf } from "./report";
import { ReportPanel } from "./ReportPanel";

interface Whole {
  report: ImportReport;
  scenario: ScenarioState;
  assets: Assets;
  drawing: PackedDrawing;
  loaded: LoadedGraph;
}

/** What became of a file that was imported, beside the map. */
export function ImportView({ scenario: name }: { scenario: string }) {
  const { value, error } = useLoaded(useCallback(() => everything(name), [name]));
  useLearnedTitle(name, value?.scenario.document.name);
  if (error)
    return (
      <div className="catalogue">
        <Alert color="red" title={t`The report of the import cannot be shown`}>
          {error}
        </Alert>
        <Group mt="md">
          <Button onClick={() => go({ view: "editor", scenario: name })}>
            <Trans>Open in the editor</Trans>
          </Button>
          <Button variant="default" onClick={() => go({ view: "catalogue" })}>
            <Trans>Back to the maps</Trans>
          </Button>
        </Group>
      </div>
    );
  if (!value)
    return (
      <div className="empty">
        <Loader aria-label={t`Loading the report`} />
      </div>
    );
  return <Shown name={name} whole={value} />;
}

async function everything(name: string): Promise<Whole> {
  const report = await exchange.report(name);
  const scenario = await api.scenario(name);
  const map = scenario.document.map.name;
  const [assets, drawing, loaded] = await Promise.all([api.assets(), loadDrawing(map), loadGraph(map)]);
  return { report, scenario, assets, drawing, loaded };
}

function Shown({ name, whole }: { name: string; whole: Whole }) {
  const { report, scenario, assets, drawing, loaded } = whole;
  const [chosen, setChosen] = useState<ImportRow | null>(null);
  const spot = useMemo(() => (chosen ? spotOf(chosen) : null), [chosen]);
  const handle = useRef<MapHandle | null>(null);
  const { document, problems } = scenario;
  const actors = useMemo(
    () => sceneActors(loaded.graph, document, assets, new Set(), new Set()),
    [loaded, document, assets],
  );
  const scene = useMemo<Scene>(
    () => ({
      ...EMPTY_SCENE,
      nodes: { vehicles: false, walks: false, inside: null },
      actors,
      pins: pinsOf(report, spot),
    }),
    [actors, report, spot],
  );
  useEffect(() => {
    const bounds = around(actors);
    if (bounds) handle.current?.show(bounds);
  }, [actors]);
  const wrong = problems.filter(({ severity }) => severity === "error").length;
  return (
    <div className="import">
      <section className="import-side" aria-label={t`Report of the import`}>
        <Title order={1} size="h4" style={{ overflowWrap: "anywhere" }}>
          <Trans>{report.file} was imported</Trans>
        </Title>
        <Text size="sm" c="dimmed" mb="sm">
          <Trans>
            <Plural value={document.actors.length} one="# road user" other="# road users" /> and{" "}
            <Plural value={document.rules.length} one="# rule" other="# rules" /> on the map {report.map}
            {report.added ? t`, which was added to your maps` : ""}.
          </Trans>
        </Text>
        <Group mb="md">
          <Button onClick={() => go({ view: "editor", scenario: name })}>
            <Trans>Open in the editor</Trans>
          </Button>
          <Button variant="default" onClick={() => go({ view: "catalogue" })}>
            <Trans>Back to the maps</Trans>
          </Button>
        </Group>
        {wrong > 0 && (
          <Alert
            color="orange"
            mb="md"
            title={t`${plural(wrong, { one: "# problem", other: "# problems" })} left to solve before it runs`}
          >
            <Trans>The editor lists them under “Problems”.</Trans>
          </Alert>
        )}
        {report.sweep && (
          <Alert color="blue" mb="md" title={t`The file varies parameters`}>
            <Trans>
              <Anchor href={exchange.planUrl(name)} download size="sm">
                Download the plan of the sweep
              </Anchor>{" "}
              for <code>odscen sweep --plan</code>.
            </Trans>
          </Alert>
        )}
        <ReportPanel
          report={report}
          chosen={chosen}
          onPlace={(row) => {
            const place = spotOf(row);
            setChosen(row);
            if (place) handle.current?.centre(place.x, place.y);
          }}
        />
      </section>
      <div className="import-map">
        <MapCanvas
          drawing={drawing}
          map={report.map}
          graph={loaded.graph}
          picker={loaded.picker}
          scene={scene}
          handle={handle}
          label={t`Map ${report.map}`}
        >
          {spot && (
            <div className="map-hint" role="status">
              <Trans>
                x = {lengthText(spot.x, 1)}, y = {lengthText(spot.y, 1)}
              </Trans>
            </div>
          )}
        </MapCanvas>
      </div>
    </div>
  );
}
