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
import { useState } from "react";

import {
  type CorridorWish,
  type CrossingTurn,
  type LightProgram,
  signals,
  type TimedSignals,
} from "../api/signals";
import type { Edit } from "../api/types";
import { Committed } from "../editor/Committed";
import type { SignalEditing, TimingResult } from "./editing";

interface Editable {
  light: LightProgram;
  junction: string;
  editing: SignalEditing;
}

const TREATMENTS = [
  { value: "permissive", label: "Gaps" },
  { value: "both", label: "Gaps and arrow" },
  { value: "protected", label: "Arrow only" },
];
const SAME = "same";

/** Whose program runs, and how; the program of the map made one of the scenario. */
export function ProgramControl({ light, junction, editing }: Editable) {
  const { timing, control, edit } = editing;
  const own = light.origin === "scenario";
  const all = control === "actuated" ? "actuated" : "fixed-time";
  return (
    <>
      <Select
        label="Control of this light"
        data={[
          { value: SAME, label: `As all lights of the scenario (${all})` },
          { value: "fixed", label: "Fixed-time" },
          { value: "actuated", label: "Actuated: vehicles and pedestrians call" },
        ]}
        value={timing?.control ?? SAME}
        allowDeselect={false}
        onChange={(value) => {
          const next = value === "fixed" || value === "actuated" ? value : null;
          if (value)
            void edit({ kind: "set_timing", junction, control: next }, `Control of light ${junction}`);
        }}
      />
      <Group gap="xs">
        {!own && (
          <Button size="compact-sm" variant="default" onClick={() => void editing.takeOver()}>
            Make the program the scenario’s own
          </Button>
        )}
        {timing && (
          <Button
            size="compact-sm"
            variant="default"
            onClick={() => void edit({ kind: "clear_timing", junction: timing.junction })}
          >
            Back to the program of the map
          </Button>
        )}
      </Group>
    </>
  );
}

/** Turns across oncoming traffic: through gaps, with an arrow, or both. */
export function TurnChoices({ light, junction, editing }: Editable) {
  if (light.turns.length === 0) return null;
  const own = light.origin === "scenario";
  const choose = (turn: CrossingTurn, value: string): void => {
    const treatment = value === "both" || value === "protected" ? value : "permissive";
    void editing.edit({ kind: "set_turn", junction, approach: turn.approach, turn: turn.turn, treatment });
  };
  return (
    <>
      <h3>Turns across oncoming traffic</h3>
      {!own && (
        <Text size="sm" c="dimmed">
          They can be changed once the program is the scenario’s own.
        </Text>
      )}
      {light.turns.map((turn) => (
        <div key={`${turn.approach} ${turn.turn}`} className="signal-turn">
          <span>
            {turn.approach} {turn.turn}
          </span>
          {turn.alone ? (
            <SegmentedControl
              size="xs"
              data={TREATMENTS}
              value={turn.treatment}
              disabled={!own}
              aria-label={`${turn.approach} ${turn.turn}`}
              onChange={(value) => choose(turn, value)}
            />
          ) : (
            <Text size="xs" c="dimmed">
              through gaps: it has no lane for itself
            </Text>
          )}
        </div>
      ))}
    </>
  );
}

/** Whether a stage with a crossing waits for a call. */
export function StageCall({ light, junction, editing, stage }: Editable & { stage: string }) {
  const one = light.plans[0]?.stages.find(({ id }) => id === stage);
  const first = light.plans[0]?.stages[0]?.id === stage;
  const walks = new Set(light.groups.filter(({ walk }) => walk).map(({ id }) => id));
  if (!one || first || light.origin !== "scenario" || !one.groups.some((id) => walks.has(id))) return null;
  const change = (on_call: boolean): Edit => ({ kind: "set_stage", junction, stage, on_call });
  return (
    <Switch
      size="xs"
      label="only when called"
      aria-label={`Stage ${stage} only when a pedestrian calls`}
      checked={one.on_call}
      onChange={(event) => void editing.edit(change(event.currentTarget.checked))}
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
      <summary>Shortest and longest greens</summary>
      <div className="signal-bounds">
        {stages.map(({ id, green, min_green, max_green }) => (
          <Group key={id} grow gap="xs" wrap="nowrap">
            <Committed
              label={`Stage ${id}, shortest`}
              suffix=" s"
              min={0}
              max={3600}
              digits={1}
              placeholder={`${green} s`}
              value={min_green ?? ""}
              onCommit={(value) => set(id, { min_green: value })}
            />
            <Committed
              label={`Stage ${id}, longest`}
              suffix=" s"
              min={0}
              max={3600}
              digits={1}
              placeholder={`${green} s`}
              value={max_green ?? ""}
              onCommit={(value) => set(id, { max_green: value })}
            />
          </Group>
        ))}
      </div>
    </details>
  );
}

const DIRECTIONS = [
  { value: "both", label: "both directions" },
  { value: "out", label: "in this order" },
  { value: "back", label: "back" },
];

/** Programs timed by rule, coordinated, and from and to files. */
export function TimingTools({
  junction,
  junctions,
  editing,
}: {
  junction: string;
  junctions: readonly string[];
  editing: SignalEditing;
}) {
  const { name, time } = editing;
  const [busy, setBusy] = useState(false);
  const [result, setResult] = useState<TimingResult | null>(null);
  const ask = async (call: (version: number) => Promise<TimedSignals>): Promise<void> => {
    setBusy(true);
    setResult(await time(call));
    setBusy(false);
  };
  return (
    <>
      <h3>Times by rule</h3>
      <Group gap="xs">
        <Button
          size="compact-sm"
          variant="default"
          loading={busy}
          onClick={() => void ask((version) => signals.webster(name, version, [junction]))}
        >
          Time it after the demand (Webster)
        </Button>
        {junctions.length > 1 && (
          <Button
            size="compact-sm"
            variant="default"
            loading={busy}
            onClick={() => void ask((version) => signals.webster(name, version, []))}
          >
            Time all {junctions.length} lights
          </Button>
        )}
      </Group>
      {junctions.length > 1 && (
        <Corridor
          junctions={junctions}
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
              Import programs …
            </Button>
          )}
        </FileButton>
        {editing.timing && (
          <Anchor size="sm" href={signals.exportUrl(name)} download>
            Export for SUMO
          </Anchor>
        )}
      </Group>
      <div role="status">
        {result && (
          <>
            <List size="sm" aria-label="What has been done">
              {result.notes.length > 0 ? (
                result.notes.map((note) => <List.Item key={note}>{note}</List.Item>)
              ) : (
                <List.Item>Done. Undo brings the times of before back.</List.Item>
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
  busy,
  onWish,
}: {
  junctions: readonly string[];
  busy: boolean;
  onWish: (wish: CorridorWish) => void;
}) {
  const [chosen, setChosen] = useState<string[]>([]);
  const [favoured, setFavoured] = useState<CorridorWish["favoured"]>("both");
  return (
    <details>
      <summary>Green wave along several lights</summary>
      <div className="signal-corridor">
        <MultiSelect
          label="Junctions in driving order"
          data={[...junctions]}
          value={chosen}
          onChange={setChosen}
          searchable
        />
        <Select
          label="Widest band"
          data={DIRECTIONS}
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
          Coordinate {chosen.length < 2 ? "two lights or more" : `${chosen.length} lights`}
        </Button>
      </div>
    </details>
  );
}
