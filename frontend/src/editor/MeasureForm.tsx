import { Group, MultiSelect, SegmentedControl, Select, TagsInput } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { CATEGORIES, type Category, type Edit } from "../api/types";
import type { PlaceNames } from "../map/placeNames";
import { CATEGORY_WORD } from "../ui/words";
import { Committed } from "./Committed";
import { PartCard, WindowFields } from "./DemandParts";
import { CommittedText, OpenAndShow, PickButton } from "./FormParts";
import { inWords, KIND, type Measure, picksOf, withPlace } from "./measures";
import { PICK_WORD } from "./MeasuresStep";
import type { Picked, PlacePick } from "./pick";

type Change = (measure: Measure, label?: string) => void;

/** One measure: a line that says what it does, and its form when it is opened. */
export function MeasureCard({
  measure,
  taken,
  open,
  places,
  pick,
  onOpen,
  onEdit,
  onShow,
}: {
  measure: Measure;
  /** Ids of all measures. */
  taken: readonly string[];
  open: boolean;
  places: PlaceNames;
  pick: PlacePick;
  onOpen: (id: string | null) => void;
  onEdit: (edit: Edit | readonly Edit[], label?: string) => void;
  onShow: () => void;
}) {
  const { id } = measure;
  const { detail, when } = inWords(measure, places);
  const change: Change = (next, label) => onEdit({ kind: "set_measure", measure: next }, label);
  const rename = (next: string): void => {
    if (!next || taken.includes(next)) return;
    onEdit({ kind: "set_measure", measure: { ...measure, id: next }, instead_of: id }, t`Rename ${id}`);
    onOpen(next);
  };
  return (
    <PartCard
      name={id}
      what={KIND()[measure.kind]}
      note={`${detail}; ${when}`}
      onRemove={() => {
        pick.stop();
        onEdit({ kind: "remove_measure", measure: id });
      }}
    >
      <OpenAndShow
        part={id}
        open={open}
        onShow={onShow}
        onOpen={() => {
          pick.stop();
          onOpen(open ? null : id);
        }}
      />
      {open && (
        <>
          <CommittedText label={t`Name`} value={id} maxLength={60} onCommit={rename} />
          <WindowFields
            begin={measure.begin}
            end={measure.end}
            onChange={(fields) => change({ ...measure, ...fields })}
          />
          <PlaceFields measure={measure} pick={pick} onChange={change} />
          <KindFields measure={measure} onChange={change} />
        </>
      )}
    </PartCard>
  );
}

/** Places by name, and more of them from the map; a click on one that is there takes it out. */
function PlaceFields({ measure, pick, onChange }: { measure: Measure; pick: PlacePick; onChange: Change }) {
  const key = `measure ${measure.id}`;
  const take = (picked: Picked): void => {
    const next = withPlace(measure, picked);
    if (next) onChange(next);
  };
  const kinds = picksOf(measure.kind);
  return (
    <>
      {"places" in measure && (
        <TagsInput
          label={t`Places`}
          description={t`at least one`}
          inputWrapperOrder={["label", "input", "description"]}
          value={[...measure.places]}
          splitChars={[",", ";", " "]}
          onChange={(places) => {
            if (places.length > 0) onChange({ ...measure, places });
          }}
        />
      )}
      <Group gap={6} role="group" aria-label={t`Choose places of ${measure.id} on the map`}>
        {kinds.map((kind) => (
          <PickButton key={kind} pick={pick} pickKey={key} by={kind} many onTake={take}>
            {t`${PICK_WORD()[kind]} on the map`}
          </PickButton>
        ))}
      </Group>
    </>
  );
}

const limit = (speed: number | null): number | "" => (speed === null ? "" : speed * 3.6);

function KindFields({ measure, onChange }: { measure: Measure; onChange: Change }) {
  switch (measure.kind) {
    case "closure":
      return (
        <Select
          label={t`Trips to what is closed`}
          data={[
            { value: "leave", label: t`are taken out at once` },
            { value: "end", label: t`end on the last open road` },
            { value: "wait", label: t`wait beside the road until it opens` },
          ]}
          allowDeselect={false}
          value={measure.destinations}
          onChange={(value) =>
            onChange({ ...measure, destinations: value === "end" || value === "wait" ? value : "leave" })
          }
        />
      );
    case "speed_limit":
      return (
        <Committed
          label={t`Speed limit`}
          suffix={" km/h"}
          min={1}
          max={300}
          digits={0}
          value={limit(measure.speed)}
          onCommit={(value) => {
            if (value !== null) onChange({ ...measure, speed: value / 3.6 });
          }}
        />
      );
    case "roadworks":
      return (
        <>
          <Committed
            label={t`Speed limit`}
            suffix={" km/h"}
            min={1}
            max={300}
            digits={0}
            placeholder={t`as it is`}
            value={limit(measure.speed)}
            onCommit={(value) => onChange({ ...measure, speed: value === null ? null : value / 3.6 })}
          />
          <Committed
            label={t`Width of the open lanes`}
            suffix={" m"}
            min={2}
            max={6}
            digits={2}
            placeholder={t`as it is`}
            value={measure.width ?? ""}
            onCommit={(width) => onChange({ ...measure, width })}
          />
          <TagsInput
            label={t`Closed lanes`}
            placeholder={measure.closed_lanes.length === 0 ? "12.0.-2" : ""}
            value={[...measure.closed_lanes]}
            splitChars={[",", ";", " "]}
            onChange={(closed_lanes) => onChange({ ...measure, closed_lanes })}
          />
        </>
      );
    case "incident":
      return (
        <Group grow align="flex-start">
          <Committed
            label={t`Metres along the road`}
            suffix={" m"}
            min={0}
            max={1e7}
            digits={1}
            value={measure.s}
            onCommit={(s) => {
              if (s !== null) onChange({ ...measure, s });
            }}
          />
          <Committed
            label={t`Length of the vehicle`}
            suffix={" m"}
            min={2}
            max={25}
            digits={1}
            value={measure.length}
            onCommit={(length) => onChange({ ...measure, length: length ?? 5 })}
          />
        </Group>
      );
    case "permission":
      return <PermissionFields measure={measure} onChange={onChange} />;
    case "signal_outage":
      return (
        <SegmentedControl
          fullWidth
          aria-label={t`What the light shows`}
          data={[
            { value: "off", label: t`Off` },
            { value: "flashing", label: t`Flashing` },
          ]}
          value={measure.shows}
          onChange={(shows) => onChange({ ...measure, shows: shows === "flashing" ? shows : "off" })}
        />
      );
  }
}

const VEHICLES = CATEGORIES.filter((one) => one !== "pedestrian");

function PermissionFields({
  measure,
  onChange,
}: {
  measure: Extract<Measure, { kind: "permission" }>;
  onChange: Change;
}) {
  const only = measure.allowed.length > 0;
  const who = only ? measure.allowed : measure.banned;
  const put = (isOnly: boolean, ones: Category[]): void =>
    onChange({ ...measure, allowed: isOnly ? ones : [], banned: isOnly ? [] : ones });
  return (
    <>
      <SegmentedControl
        fullWidth
        aria-label={t`Who is meant`}
        data={[
          { value: "only", label: t`Only these may` },
          { value: "not", label: t`These may not` },
        ]}
        value={only ? "only" : "not"}
        onChange={(next) => put(next === "only", who)}
      />
      <MultiSelect
        label={t`Vehicles`}
        data={VEHICLES.map((value) => ({ value, label: CATEGORY_WORD()[value] }))}
        value={who}
        onChange={(next) => {
          const ones = VEHICLES.filter((one) => next.includes(one));
          if (ones.length > 0) put(only, ones);
        }}
      />
    </>
  );
}
