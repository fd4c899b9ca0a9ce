import {
  Anchor,
  Button,
  FileButton,
  Group,
  List,
  MultiSelect,
  SegmentedControl,
  Select,
  Switch,
  Text,
} from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { localized } from "../language/localized";
import {
  type CorridorWish,
  type CrossingTurn,
  type LightProgram,
  signals,
  type TimedSignals,
} from "../api/signals";
import type { Edit } from "../api/types";
import { Committed } from "../editor/Committed";
import { byNameOrId, junctionChoices } from "../ui/choices";
import { useAsked } from "../ui/useAsked";
import type { ApproachNames, PlaceNames } from "../map/placeNames";
import type { SignalEditing, TimingResult } from "./editing";
import { served } from "../language/served";

interface Editable {
  light: LightProgram;
  junction: string;
  editing: SignalEditing;
}

type Named = Editable & { names: ApproachNames };

const TREATMENTS = localized(() => [
  { value: "permissive", label: t`Gaps` },
  { value: "both", label: t`Gaps and arrow` },
  { value: "protected", label: t`Arrow only` },
]);
const SAME = "same";

/** Whose program runs, and how; the program of the map made one of the scenario. */
export function ProgramControl({ light, junction, places, editing }: Editable & { places: PlaceNames }) {
  const { timing, control, edit } = editing;
  const own = light.origin === "scenario";
  const all = {
    fixed: t`fixed-time`,
    extended: t`extended`,
    actuated: t`actuated`,
    unsaid: t`default`,
  }[control ?? "unsaid"];
  return (
    <>
      <Select
        label={t`Control of this light`}
        data={[
          { value: SAME, label: t`As all lights of the scenario (${all})` },
          { value: "fixed", label: t`Fixed-time` },
          ...(own
            ? []
            : [{ value: "extended", label: t`Extended: fixed-time, longer while vehicles follow` }]),
          { value: "actuated", label: t`Actuated: vehicles and pedestrians call` },
        ]}
        value={timing?.control ?? SAME}
        allowDeselect={false}
        onChange={(value) => {
          const next = value === "fixed" || value === "extended" || value === "actuated" ? value : null;
          if (value)
            void edit(
              { kind: "set_timing", junction, control: next },
              t`Control of light ${places.junction(junction)}`,
            );
        }}
      />
      <Group gap="xs">
        {!own && (
          <Button size="compact-sm" variant="default" onClick={() => void editing.takeOver()}>
            <Trans>Customise this program</Trans>
          </Button>
        )}
        {timing && (
          <Button
            size="compact-sm"
            variant="default"
            onClick={() => void edit({ kind: "clear_timing", junction: timing.junction })}
          >
            <Trans>Back to the program of the map</Trans>
          </Button>
        )}
      </Group>
    </>
  );
}

const turnWords = (names: ApproachNames, { approach, turn }: CrossingTurn): string =>
  names.movement(`${approach} ${turn}`);

/** Turns across oncoming traffic: through gaps, with an arrow, or both. */
export function TurnChoices({ light, junction, editing, names }: Named) {
  if (light.turns.length === 0) return null;
  const own = light.origin === "scenario";
  return (
    <>
      <h3>
        <Trans>Turns across oncoming traffic</Trans>
      </h3>
      {!own && (
        <Text size="sm" c="dimmed">
          <Trans>They can be changed once the program is the scenario’s own.</Trans>
        </Text>
      )}
      {light.turns.map((turn) => (
        <div key={`${turn.approach} ${turn.turn}`} className="signal-turn">
          <span>{turnWords(names, turn)}</span>
          {turn.alone ? (
            <Treatment light={light} turn={turn} junction={junction} editing={editing} names={names} />
          ) : (
            <Text size="xs" c="dimmed">
              <Trans>permissive: shared lane</Trans>
            </Text>
          )}
        </div>
      ))}
    </>
  );
}

function Treatment({ light, junction, editing, names, turn }: Named & { turn: CrossingTurn }) {
  const { approach, turn: side } = turn;
  const [treatment, ask] = useAsked<string>(turn.treatment, light);
  const choose = (value: string): void => {
    const next = value === "both" || value === "protected" ? value : "permissive";
    ask(next, editing.edit({ kind: "set_turn", junction, approach, turn: side, treatment: next }));
  };
  return (
    <SegmentedControl
      size="xs"
      data={TREATMENTS()}
      value={treatment}
      disabled={light.origin !== "scenario"}
      aria-label={turnWords(names, turn)}
      onChange={choose}
    />
  );
}

/** Whether a stage waits for a call. */
export function StageCall({ light, junction, editing, stage }: Editable & { stage: string }) {
  const one = light.plans[0]?.stages.find(({ id }) => id === stage);
  const first = light.plans[0]?.stages[0]?.id === stage;
  const [called, ask] = useAsked(one?.on_call ?? false, light);
  if (!one || first || light.origin !== "scenario") return null;
  const change = (on_call: boolean): Edit => ({ kind: "set_stage", junction, stage, on_call });
  return (
    <Switch
      size="xs"
      label={t`only when called`}
      aria-label={t`Stage ${stage} only when called`}
      checked={called}
      onChange={({ currentTarget: { checked } }) => ask(checked, editing.edit(change(checked)))}
    />
  );
}

/** Between which times detectors may end the green of each stage; of a program of the scenario. */
export function StageBounds({ junction, editing }: Omit<Editable, "light">) {
  const { timing, control, edit } = editing;
  const stages = timing?.stages ?? [];
  if (stages.length === 0 || (timing?.control ?? control) !== "actuated") return null;
  const set = (stage: string, fields: { min_green?: number | null; max_green?: number | null }): void => {
    void edit({ kind: "set_stage", junction, stage, ...fields });
  };
  return (
    <details>
      <summary>
        <Trans>Shortest and longest greens</Trans>
      </summary>
      <div className="signal-bounds">
        {stages.map(({ id, green, min_green, max_green }) => (
          <Group key={id} grow gap="xs" wrap="nowrap">
            <Committed
              label={t`Stage ${id}, shortest`}
              suffix={" s"}
              min={0}
              max={3600}
              digits={1}
              placeholder={t`${green} s`}
              value={min_green ?? ""}
              onCommit={(value) => set(id, { min_green: value })}
            />
            <Committed
              label={t`Stage ${id}, longest`}
              suffix={" s"}
              min={0}
              max={3600}
              digits={1}
              placeholder={t`${green} s`}
              value={max_green ?? ""}
              onCommit={(value) => set(id, { max_green: value })}
            />
          </Group>
        ))}
      </div>
    </details>
  );
}

const DIRECTIONS = localized(() => [
  { value: "both", label: t`both directions` },
  { value: "out", label: t`in this order` },
  { value: "back", label: t`back` },
]);

/** Programs timed by rule, coordinated, and from and to files. */
export function TimingTools({
  junction,
  junctions,
  places,
  editing,
}: {
  junction: string;
  junctions: readonly string[];
  places: PlaceNames;
  editing: SignalEditing;
}) {
  const { name, time } = editing;
  const [busy, setBusy] = useState(false);
  const [result, setResult] = useState<TimingResult | null>(null);
  const [arrows, setArrows] = useState(false);
  const ask = async (call: (version: number) => Promise<TimedSignals>): Promise<void> => {
    setBusy(true);
    setResult(await time(call));
    setBusy(false);
  };
  return (
    <>
      <h3>
        <Trans>Signal optimisation</Trans>
      </h3>
      <Group gap="xs">
        <Button
          size="compact-sm"
          variant="default"
          loading={busy}
          onClick={() => void ask((version) => signals.webster(name, version, [junction], arrows))}
        >
          <Trans>Optimise for demand (Webster)</Trans>
        </Button>
        {junctions.length > 1 && (
          <Button
            size="compact-sm"
            variant="default"
            loading={busy}
            onClick={() => void ask((version) => signals.webster(name, version, [], arrows))}
          >
            <Trans>Time all {junctions.length} lights</Trans>
          </Button>
        )}
      </Group>
      <Switch
        size="sm"
        label={t`Add protected turns where volumes warrant`}
        description={t`Turns across oncoming traffic with a lane for themselves get a protected stage, too.`}
        checked={arrows}
        onChange={({ currentTarget: { checked } }) => setArrows(checked)}
      />
      {junctions.length > 1 && (
        <Corridor
          junctions={junctions}
          places={places}
          busy={busy}
          onWish={(wish) => void ask((version) => signals.corridor(name, version, wish))}
        />
      )}
      <Group gap="xs">
        <FileButton
          accept=".xml"
          onChange={(file) => {
            if (file) void ask((version) => signals.import(name, version, file, null));
          }}
        >
          {(props) => (
            <Button {...props} size="compact-sm" variant="default" loading={busy}>
              <Trans>Import programs …</Trans>
            </Button>
          )}
        </FileButton>
        {editing.timing && (
          <Anchor size="sm" href={signals.exportUrl(name)} download>
            <Trans>Export for SUMO</Trans>
          </Anchor>
        )}
      </Group>
      <div role="status">
        {result && (
          <>
            <List size="sm" aria-label={t`What has been done`}>
              {result.notes.length > 0 ? (
                result.notes.map((note) => <List.Item key={note}>{served(note)}</List.Item>)
              ) : (
                <List.Item>
                  <Trans>Done. Undo brings the times of before back.</Trans>
                </List.Item>
              )}
            </List>
            {result.picture && (
              <div className="signal-wave" dangerouslySetInnerHTML={{ __html: result.picture }} />
            )}
          </>
        )}
      </div>
    </>
  );
}

/** A green wave: lights in driving order, and the direction whose band is to be the widest. */
function Corridor({
  junctions,
  places,
  busy,
  onWish,
}: {
  junctions: readonly string[];
  places: PlaceNames;
  busy: boolean;
  onWish: (wish: CorridorWish) => void;
}) {
  const [chosen, setChosen] = useState<string[]>([]);
  const [favoured, setFavoured] = useState<CorridorWish["favoured"]>("both");
  return (
    <details>
      <summary>
        <Trans>Green wave along several lights</Trans>
      </summary>
      <div className="signal-corridor">
        <MultiSelect
          label={t`Junctions in driving order`}
          data={junctionChoices(places, junctions)}
          filter={byNameOrId}
          value={chosen}
          onChange={setChosen}
          searchable
        />
        <Select
          label={t`Widest band`}
          data={DIRECTIONS()}
          value={favoured}
          allowDeselect={false}
          onChange={(value) => setFavoured(value === "out" || value === "back" ? value : "both")}
        />
        <Button
          size="compact-sm"
          loading={busy}
          disabled={chosen.length < 2}
          onClick={() => onWish({ junctions: chosen, along: [], favoured, speed: null, cycle: null })}
        >
          <Trans>Coordinate {chosen.length < 2 ? t`two lights or more` : t`${chosen.length} lights`}</Trans>
        </Button>
      </div>
    </details>
  );
}
