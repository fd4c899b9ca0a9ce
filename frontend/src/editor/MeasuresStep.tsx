import { Button, Group, SegmentedControl, Select, Stack, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { localized } from "../language/localized";
import type { Edit } from "../api/types";
import { isKey } from "../lists";
import type { PlaceNames } from "../map/placeNames";
import { byNameOrId, junctionChoices } from "../ui/choices";
import { useKeptForm } from "../ui/keptForm";
import { MeasureCard } from "./MeasureForm";
import { KIND, type Measure, newMeasure, picksOf } from "./measures";
import { namedPlace, type PlacePick, type PickBy, type Picked, useTaking } from "./pick";

const NEW = localized(() => t`new measure`);

export const PICK_WORD = localized((): Record<PickBy, string> => ({
  segment: t`Road`,
  lane: t`Lane`,
  turn: t`Turn`,
  point: t`Point of a lane`,
  light: t`Traffic light`,
  loop: t`Detector`,
  node: t`Point of a lane`,
  goal: t`Goal`,
  place: t`Place`,
  ground: t`Point`,
}));

/** Closures, roadworks and the like: a list with a form for each, and the places on the map. */
export function MeasuresStep({
  measures,
  lights,
  places,
  pick,
  onEdit,
  onShow,
}: {
  measures: readonly Measure[];
  /** Junctions with a traffic light. */
  lights: readonly string[];
  places: PlaceNames;
  pick: PlacePick;
  onEdit: (edit: Edit | readonly Edit[], label?: string) => void;
  onShow: (measure: Measure) => void;
}) {
  const [open, setOpen] = useState<string | null>(null);
  return (
    <>
      <Text size="sm">
        <Trans>What traffic may do is changed for a time; the map stays as it is.</Trans>
      </Text>
      {measures.map((measure) => (
        <MeasureCard
          key={measure.id}
          measure={measure}
          taken={measures.map(({ id }) => id)}
          open={open === measure.id}
          places={places}
          pick={pick}
          onOpen={setOpen}
          onEdit={onEdit}
          onShow={() => onShow(measure)}
        />
      ))}
      <NewMeasure
        measures={measures}
        lights={lights}
        places={places}
        pick={pick}
        onAdd={(measure) => {
          onEdit({ kind: "set_measure", measure }, t`Add ${measure.id}`);
          pick.stop();
          setOpen(measure.id);
        }}
      />
    </>
  );
}

/** A new measure begins with its kind and its first place, picked or typed. */
function NewMeasure({
  measures,
  lights,
  places,
  pick,
  onAdd,
}: {
  measures: readonly Measure[];
  lights: readonly string[];
  places: PlaceNames;
  pick: PlacePick;
  onAdd: (measure: Measure) => void;
}) {
  const [kind, setKind] = useKeptForm<Measure["kind"]>("kind of measure", "closure");
  const [by, setBy] = useState<PickBy>("segment");
  const [typed, setTyped] = useKeptForm("place of measure", "");
  const choices = picksOf(kind);
  const chosen = choices.includes(by) ? by : (choices[0] ?? "segment");
  const add = (picked: Picked): void => {
    onAdd(newMeasure(kind, picked, measures));
    setTyped("");
  };
  const active = useTaking(pick, NEW(), add);
  const arm = (choice: PickBy): void => {
    if (active) pick.start(NEW(), choice);
  };
  const type = (): void => {
    if (typed.trim()) add(namedPlace(typed.trim()));
  };
  return (
    <section className="fold" aria-label={t`New measure`}>
      <Select
        label={t`Kind of measure`}
        data={Object.entries(KIND()).map(([value, label]) => ({ value, label }))}
        value={kind}
        allowDeselect={false}
        onChange={(next) => {
          if (!isKey(KIND(), next)) return;
          setKind(next);
          arm(picksOf(next)[0] ?? "segment");
        }}
      />
      {choices.length > 1 && (
        <SegmentedControl
          fullWidth
          size="xs"
          aria-label={t`What it is about`}
          data={choices.map((choice) => ({ value: choice, label: PICK_WORD()[choice] }))}
          value={chosen}
          onChange={(next) => {
            const choice = choices.find((one) => one === next) ?? chosen;
            setBy(choice);
            arm(choice);
          }}
        />
      )}
      <Stack gap={6}>
        <Button aria-pressed={active} onClick={() => (active ? pick.stop() : pick.start(NEW(), chosen))}>
          {active ? t`Stop choosing` : t`Choose it on the map`}
        </Button>
        {kind === "signal_outage" ? (
          <Select
            label={t`or its junction`}
            data={junctionChoices(places, lights)}
            value={null}
            searchable
            filter={byNameOrId}
            onChange={(name) => {
              if (name) add(namedPlace(name));
            }}
          />
        ) : (
          <Group gap={6} align="flex-end" wrap="nowrap">
            <TextInput
              style={{ flex: 1 }}
              label={t`or type its name`}
              placeholder={kind === "incident" ? "12.0.-2" : t`r12, 12.0.-2 or r12>r8`}
              value={typed}
              onChange={(event) => setTyped(event.currentTarget.value)}
              onKeyDown={(event) => {
                if (event.key === "Enter") type();
              }}
            />
            <Button variant="default" disabled={!typed.trim()} onClick={type}>
              <Trans>Add</Trans>
            </Button>
          </Group>
        )}
      </Stack>
    </section>
  );
}
