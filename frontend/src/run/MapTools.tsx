import { Select } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import type { ReactNode } from "react";

import { type ColourBy, coloursFor } from "./tint";

/** What lies on the map of a run and is not the map: what colours say, and who is followed. */
export function MapTools({
  by,
  live,
  lights,
  onBy,
  share,
  look,
  views,
  children,
}: {
  by: ColourBy;
  /** Whether the run is watched while it runs. */
  live: boolean;
  /** Whether states of traffic lights are known. */
  lights: boolean;
  onBy: (by: ColourBy) => void;
  /** What the picture is taken away with. */
  share?: ReactNode;
  /** What chooses between plan and three dimensions. */
  look?: ReactNode;
  /** What adds a view, or closes this one. */
  views?: ReactNode;
  children?: ReactNode;
}) {
  return (
    <div
      className="map-tools"
      onPointerDown={(event) => event.stopPropagation()}
      onPointerMove={(event) => event.stopPropagation()}
    >
      <div className="map-tools-row">
        <Select
          size="xs"
          w={176}
          aria-label={t`Colour by`}
          leftSection={
            <span aria-hidden="true">
              <Trans>Colour</Trans>
            </span>
          }
          leftSectionWidth={54}
          allowDeselect={false}
          data={coloursFor(live, lights || by === "signal")}
          value={by}
          onChange={(next) => {
            if (next) onBy(next as ColourBy);
          }}
        />
        {look}
        {share}
        {views}
      </div>
      {children}
    </div>
  );
}
