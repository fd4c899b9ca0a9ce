import { ActionIcon, Checkbox, Popover, Slider, Stack, Text, Tooltip } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { useLingui } from "@lingui/react";
import { Trans } from "@lingui/react/macro";
import { memo, type ReactNode } from "react";

import { localized } from "../language/localized";
import { IconFit, IconLayers, IconMinus, IconPlus, IconRuler } from "../ui/icons";
import { type MapLayers, showLayer, useMapLayers } from "./mapLayers";
import { showRoads, useUnderlays } from "./underlay";

const NAMES = localized((): Record<keyof MapLayers, string> => ({
  grid: t`Grid with coordinates`,
  names: t`Names of roads and junctions`,
  nodes: t`Start points and lane graph, when near`,
  changes: t`Lane changes of the lane graph`,
  signs: t`Signs and traffic lights`,
  buildings: t`Buildings`,
  picture: t`Picture under the map`,
  overview: t`Overview map`,
}));

/** Buttons on a map: what it shows, how far and how large. */
export const MapButtons = memo(function MapButtons({
  onZoom,
  onAll,
  measuring,
  onMeasure,
  pictured,
}: {
  onZoom: (factor: number) => void;
  onAll: () => void;
  measuring: boolean;
  onMeasure: () => void;
  /** Whether a picture lies under the map. */
  pictured: boolean;
}) {
  // Drawn anew with another language.
  useLingui();
  return (
    <div className="map-buttons">
      <LayersButton pictured={pictured} />
      <MapButton label={t`Measure lengths and areas (R)`} pressed={measuring} onClick={onMeasure}>
        <IconRuler />
      </MapButton>
      <MapButton label={t`Zoom in`} onClick={() => onZoom(1.5)}>
        <IconPlus />
      </MapButton>
      <MapButton label={t`Zoom out`} onClick={() => onZoom(1 / 1.5)}>
        <IconMinus />
      </MapButton>
      <MapButton label={t`Show the whole map`} onClick={onAll}>
        <IconFit />
      </MapButton>
    </div>
  );
});

function LayersButton({ pictured }: { pictured: boolean }) {
  const layers = useMapLayers();
  const roads = useUnderlays((all) => all.roads);
  const names = (Object.keys(NAMES()) as (keyof MapLayers)[]).filter(
    (name) => pictured || name !== "picture",
  );
  return (
    <Popover position="left-end" shadow="md" trapFocus returnFocus>
      <Popover.Target>
        <Tooltip label={t`Layers of the map`} position="left">
          <ActionIcon variant="default" size="lg" aria-label={t`Layers of the map`}>
            <IconLayers />
          </ActionIcon>
        </Tooltip>
      </Popover.Target>
      <Popover.Dropdown aria-label={t`Layers of the map`}>
        <Stack gap="xs">
          <strong>
            <Trans>On the map</Trans>
          </strong>
          {names.map((name) => (
            <Checkbox
              key={name}
              size="sm"
              label={NAMES()[name]}
              checked={layers[name]}
              onChange={({ currentTarget: { checked } }) => showLayer(name, checked)}
            />
          ))}
          {pictured && layers.picture && (
            <div>
              <Text size="sm" id="roads-over-picture">
                <Trans>Roads over the picture</Trans>
              </Text>
              <Slider
                min={0}
                max={1}
                step={0.05}
                value={roads}
                onChange={showRoads}
                label={(share) => `${Math.round(share * 100)} %`}
                thumbProps={{ "aria-labelledby": "roads-over-picture" }}
              />
            </div>
          )}
        </Stack>
      </Popover.Dropdown>
    </Popover>
  );
}

function MapButton({
  label,
  pressed,
  onClick,
  children,
}: {
  label: string;
  pressed?: boolean;
  onClick: () => void;
  children: ReactNode;
}) {
  return (
    <Tooltip label={label} position="left">
      <ActionIcon
        variant={pressed ? "filled" : "default"}
        size="lg"
        aria-label={label}
        aria-pressed={pressed}
        onClick={onClick}
      >
        {children}
      </ActionIcon>
    </Tooltip>
  );
}
