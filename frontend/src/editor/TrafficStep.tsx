import { Button, Stack, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { parsedDayTime, dayTime } from "../language/units";
import type { Edit, ScenarioDocument } from "../api/types";
import type { PlaceNames } from "../map/placeNames";
import { BackgroundForm } from "./BackgroundForm";
import { InputForm, NewInput } from "./InputForm";
import { bringsTraffic, freeName } from "./demand";
import { CountsList, MatrixForm, ProfileList, ZoneList } from "./DemandParts";
import type { Profiles } from "./DayProfiles";
import { ParkingForm } from "./ParkingForm";
import { RoutesForm } from "./RoutesForm";
import type { EditorStore } from "./store";
import { TableForm } from "./TableForm";
import { WholeDay } from "./WholeDay";

type Adding = "input" | "day" | "table" | null;

/** All traffic besides the road users placed by hand: background, trips from tables, counts. */
export function TrafficStep({
  store,
  document,
  roads,
  places,
  profiles,
  onEdit,
  onShow,
}: {
  store: EditorStore;
  document: ScenarioDocument;
  roads: readonly string[];
  places: PlaceNames;
  profiles: Profiles;
  onEdit: (edit: Edit) => void;
  /** Shows segments on the map. */
  onShow: (segments: readonly string[]) => void;
}) {
  const { demand } = document;
  const [adding, setAdding] = useState<Adding>(null);
  const [wrongClock, setWrongClock] = useState(false);
  const remove = (part: string): void => onEdit({ kind: "remove_demand", part });
  const setClock = (text: string): void => {
    const clock = text.trim() ? parsedDayTime(text) : 0;
    setWrongClock(clock === null);
    if (clock !== null && Math.floor(clock / 60) !== Math.floor(demand.clock / 60))
      onEdit({ kind: "set_clock", clock });
  };
  const toggle = (what: Adding): void => setAdding(adding === what ? null : what);
  return (
    <>
      <TextInput
        label={t`Time of day at the start`}
        placeholder={t`Not set: times count from the start`}
        error={wrongClock && t`Hours and minutes, such as ${dayTime(27_000)} or ${dayTime(62_100)}`}
        key={demand.clock}
        defaultValue={demand.clock ? dayTime(demand.clock) : ""}
        onBlur={(event) => setClock(event.currentTarget.value)}
        onKeyDown={(event) => {
          if (event.key === "Enter") setClock(event.currentTarget.value);
        }}
      />
      {demand.inputs.map((one) => (
        <InputForm
          key={one.id}
          input={one}
          places={places}
          profiles={profiles}
          onEdit={onEdit}
          onShow={onShow}
          onRemove={() => remove(one.id)}
        />
      ))}
      {demand.background.map((one) => (
        <BackgroundForm
          key={one.id}
          background={one}
          profiles={profiles}
          onEdit={onEdit}
          onRemove={() => remove(one.id)}
        />
      ))}
      {demand.matrices.map((one) => (
        <MatrixForm
          key={one.id}
          matrix={one}
          profiles={profiles}
          onEdit={onEdit}
          onRemove={() => remove(one.id)}
        />
      ))}
      {demand.counts.map((one) => (
        <CountsList
          key={one.id}
          counts={one}
          onEdit={onEdit}
          onShow={onShow}
          onRemove={() => remove(one.id)}
        />
      ))}
      {demand.zones.length > 0 && <ZoneList zones={demand.zones} onShow={onShow} onRemove={remove} />}
      {bringsTraffic(demand) && <RoutesForm routes={demand.routes} onEdit={onEdit} />}
      {bringsTraffic(demand) && <ParkingForm parking={demand.parking} onEdit={onEdit} />}
      <Stack gap={6}>
        <Button
          variant="default"
          onClick={() =>
            onEdit({ kind: "set_background", background: freeName(demand, "background"), per_km: 5 })
          }
        >
          <Trans>Add background traffic</Trans>
        </Button>
        <Button variant="default" aria-expanded={adding === "input"} onClick={() => toggle("input")}>
          <Trans>Add vehicle inputs</Trans>
        </Button>
        {adding === "input" && (
          <NewInput
            store={store}
            places={places}
            demand={demand}
            onShow={onShow}
            onEdit={(edit) => {
              onEdit(edit);
              setAdding(null);
            }}
          />
        )}
        <Button variant="default" aria-expanded={adding === "day"} onClick={() => toggle("day")}>
          <Trans>Whole day on the whole map</Trans>
        </Button>
        {adding === "day" && <WholeDay store={store} onDone={() => setAdding(null)} />}
        <Button variant="default" aria-expanded={adding === "table"} onClick={() => toggle("table")}>
          <Trans>Import a table</Trans>
        </Button>
        {adding === "table" && <TableForm store={store} demand={demand} roads={roads} />}
      </Stack>
      <ProfileList profiles={profiles} own={demand.profiles.map(({ id }) => id)} onRemove={remove} />
      <Text size="xs" c="dimmed">
        <Trans>Road users that were placed by hand keep their start and departure.</Trans>
      </Text>
    </>
  );
}
