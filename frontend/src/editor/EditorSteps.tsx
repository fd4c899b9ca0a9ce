import { Button, Loader, Text } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { useLingui } from "@lingui/react";
import { Trans } from "@lingui/react/macro";
import { memo, useMemo, useState } from "react";

import type { Chosen } from "../api/models";
import type { Assets, Edit } from "../api/types";
import { inBounds, inCircle } from "../map/areas";
import { localized } from "../language/localized";
import type { PackedDrawing } from "../map/drawing";
import { ActorStep } from "./ActorStep";
import { criteriaNote } from "./criteria";
import { CriteriaStep } from "./CriteriaStep";
import { profilesOf } from "./DayProfiles";
import { bringsTraffic, trafficNote } from "./demand";
import { EnvironmentStep } from "./EnvironmentStep";
import { LightsStep, lightsNote } from "./LightsStep";
import { measureNote } from "./measures";
import { MeasuresStep } from "./MeasuresStep";
import { MapStep, RegionStep } from "./MapSteps";
import { actorNote, weatherNote } from "./notes";
import { parameterNote } from "./parameters";
import { ParametersStep } from "./ParametersStep";
import { ruleNote, RulesStep } from "./rules/RulesStep";
import { rowsWithin } from "./regions";
import type { Step } from "./scene";
import type { RunChoices } from "./runChoices";
import { RunStep } from "./RunStep";
import { Steps } from "./Steps";
import type { EditorStore } from "./store";
import { studyNote, WHOLE_RUN } from "./study";
import { StudyStep } from "./StudyStep";
import { TrafficStep } from "./TrafficStep";
import { transitNote } from "./transit";
import { TransitStep } from "./TransitStep";
import { type EditorNow, sameButPointer } from "./useEditing";

interface Props {
  store: EditorStore;
  now: EditorNow;
  drawing: PackedDrawing;
  assets: Assets | null;
  choices: RunChoices;
  /** What keeps the scenario from being run. */
  hindrance: Hindrance | null;
  starting: boolean;
  onRun: () => void;
}

/** Errors to be solved, or no road users. */
export interface Hindrance {
  errors: number;
  empty: boolean;
}

/** What the steps are called. */
export const STEP_TITLE = localized((): Record<Step, string> => ({
  map: t`Map`,
  region: t`Region`,
  environment: t`Weather and time`,
  actors: t`Road users`,
  traffic: t`Demand`,
  transit: t`Public transport`,
  lights: t`Traffic lights`,
  measures: t`Measures`,
  rules: t`Rules`,
  parameters: t`Parameters`,
  study: t`Analysis`,
  criteria: t`Criteria`,
  run: t`Run`,
}));

/** The steps, each with its forms; they are not made anew as the pointer moves. */
export const EditorSteps = memo(
  AllSteps,
  ({ now: old, ...before }: Props, { now, ...after }: Props) =>
    before.store === after.store &&
    before.drawing === after.drawing &&
    before.assets === after.assets &&
    before.choices === after.choices &&
    before.starting === after.starting &&
    sameButPointer(old, now),
);

function AllSteps({ store, now, drawing, assets, choices, hindrance, starting, onRun }: Props) {
  // Drawn anew with another language.
  useLingui();
  const {
    scenario: { name, version },
    document,
    graph,
    region,
    ones,
    one,
    selection,
    changes,
    sights,
    openStep,
  } = now;
  const { roi, demand, environment, map, measures, study, transit } = document;
  const [filling, setFilling] = useState(false);
  const profiles = useMemo(() => profilesOf(demand, assets?.day_profiles ?? {}), [demand, assets]);
  const selected = useMemo(() => {
    const chosen = new Set(selection);
    return ones.filter(({ id }) => chosen.has(id));
  }, [ones, selection]);
  const roads = useMemo(() => {
    const kinds = new Map(graph.columns.segments.map(({ id, kind }) => [id, kind]));
    return roi.filter((id) => kinds.get(id) !== "junction");
  }, [graph, roi]);
  const errors = hindrance?.errors ?? 0;
  const junctions = now.lights?.junctions ?? [];

  const addNeighbours = (): void =>
    changes.change(
      region.candidates.map((segment): Edit => ({ kind: "grow_roi", segment })),
      t`Add ${plural(region.candidates.length, { one: "# segment", other: "# segments" })}`,
    );
  const fill = async (share: number, seed: number, filler: Chosen | null): Promise<void> => {
    setFilling(true);
    if (await changes.fill(share, seed, filler).finally(() => setFilling(false))) now.select([]);
  };
  const titles = STEP_TITLE();
  return (
    <Steps
      open={now.step}
      onOpen={openStep}
      steps={{
        map: {
          title: titles.map,
          done: true,
          note: map.name,
          body: <MapStep name={map.name} onShow={() => sights.bounds(drawing.bounds)} />,
        },
        region: {
          title: titles.region,
          done: roi.length > 0,
          note: roi.length
            ? plural(roi.length, { one: "# segment", other: "# segments" })
            : t`Where does it happen?`,
          body: (
            <RegionStep
              segments={roi.length}
              region={region}
              onNext={() => openStep("environment")}
              onAll={addNeighbours}
              onShow={() => sights.segments(roi)}
              onWhole={() => changes.extendRegion(graph.columns.segments.map((_, row) => row))}
              onSeen={() => {
                const seen = sights.seen();
                if (seen) changes.extendRegion(rowsWithin(graph, inBounds(seen)));
              }}
              onWithin={(metres) => {
                const middle = sights.middle();
                if (middle) changes.extendRegion(rowsWithin(graph, inCircle(middle, metres)));
              }}
              onBegin={sights.pickMiddle}
            />
          ),
        },
        environment: {
          title: titles.environment,
          done: roi.length > 0,
          note: weatherNote(assets, environment.preset),
          body: assets ? (
            <>
              <EnvironmentStep assets={assets} document={document} onEdit={changes.change} />
              <Button onClick={() => openStep("actors")}>
                <Trans>Next: road users</Trans>
              </Button>
            </>
          ) : (
            <Loader size="sm" aria-label={t`Loading the weather`} />
          ),
        },
        actors: {
          title: titles.actors,
          done: ones.length > 0,
          note: actorNote(document),
          body:
            roi.length === 0 ? (
              <>
                <Text size="sm">
                  <Trans>Road users start inside the region. Choose the region first.</Trans>
                </Text>
                <Button onClick={() => openStep("region")}>
                  <Trans>Choose the region</Trans>
                </Button>
              </>
            ) : (
              <>
                <ActorStep
                  assets={assets}
                  graph={graph}
                  starts={now.starts}
                  selected={selected}
                  tool={now.tool}
                  goals={now.goals}
                  actors={document.actors.length}
                  profiles={profiles}
                  driverSets={document.drivers.sets.map(({ id }) => id)}
                  filling={filling}
                  onTool={now.arm}
                  onPlaceSomewhere={now.placeSomewhere}
                  onEdit={changes.change}
                  onStart={changes.setStart}
                  onGoal={changes.setGoal}
                  onRemove={() => changes.remove(selection)}
                  onSelect={now.select}
                  onShowGoals={() => {
                    if (one) sights.goals(one, now.goals ?? []);
                  }}
                  onFill={(share, seed, filler) => void fill(share, seed, filler)}
                />
                {ones.length > 0 && (
                  <Button variant="default" onClick={() => openStep("traffic")}>
                    <Trans>Next: demand</Trans>
                  </Button>
                )}
              </>
            ),
        },
        traffic: {
          title: titles.traffic,
          done: bringsTraffic(demand),
          note: trafficNote(demand),
          body: (
            <>
              <TrafficStep
                store={store}
                document={document}
                roads={roads}
                places={graph.names}
                profiles={profiles}
                onEdit={changes.change}
                onShow={sights.segments}
              />
              <Button variant="default" onClick={() => openStep("transit")}>
                <Trans>Next: public transport</Trans>
              </Button>
            </>
          ),
        },
        transit: {
          title: titles.transit,
          done: transit.lines.length > 0,
          note: transitNote(transit),
          body: (
            <TransitStep
              transit={transit}
              graph={graph}
              pick={now.pick}
              onEdit={changes.change}
              onShow={sights.nodes}
            />
          ),
        },
        lights: {
          title: titles.lights,
          done: document.signals.junctions.length > 0,
          note: now.lights ? lightsNote(junctions) : "…",
          body: (
            <LightsStep
              junctions={junctions}
              places={graph.names}
              shown={now.light}
              control={document.signals.control}
              onEdit={changes.change}
              onShow={now.showLight}
            />
          ),
        },
        measures: {
          title: titles.measures,
          done: measures.length > 0,
          note: measureNote(measures),
          body: (
            <MeasuresStep
              measures={measures}
              lights={now.lights?.junctions ?? []}
              places={graph.names}
              pick={now.pick}
              onEdit={changes.change}
              onShow={sights.measure}
            />
          ),
        },
        rules: {
          title: titles.rules,
          done: document.rules.length > 0,
          note: ruleNote(document.rules),
          body: (
            <RulesStep
              document={document}
              pick={now.pick}
              onDraft={now.setDrafted}
              onEdit={changes.change}
              onShow={(rule) => sights.rule(rule, document.actors)}
            />
          ),
        },
        parameters: {
          title: titles.parameters,
          done: Object.keys(document.parameters).length > 0,
          note: parameterNote(document.parameters),
          body: (
            <ParametersStep
              name={name}
              document={document}
              onEdit={changes.change}
              onShow={({ root, id }) => {
                const user = ones.find((each) => each.id === id);
                const rule = document.rules.find((each) => each.id === id);
                if (root === "rules" && rule) sights.rule(rule, document.actors);
                else if (user) sights.close(user);
              }}
            />
          ),
        },
        study: {
          title: titles.study,
          done: studyNote(study) !== WHOLE_RUN(),
          note: studyNote(study),
          body: (
            <StudyStep
              study={study}
              graph={graph}
              pick={now.pick}
              onEdit={changes.change}
              onShow={sights.nodes}
            />
          ),
        },
        criteria: {
          title: titles.criteria,
          done: document.criteria.length > 0,
          note: criteriaNote(document.criteria),
          body: <CriteriaStep document={document} onEdit={changes.change} />,
        },
        run: {
          title: titles.run,
          done: false,
          note: errors
            ? t`${plural(errors, { one: "# problem", other: "# problems" })} to solve first`
            : t`Watch it live`,
          body: (
            <RunStep
              name={name}
              version={version}
              document={document}
              places={graph.names}
              choices={choices}
              blocked={errors > 0}
              busy={starting}
              empty={hindrance?.empty ?? false}
              onEdit={changes.change}
              onRun={onRun}
            />
          ),
        },
      }}
    />
  );
}
