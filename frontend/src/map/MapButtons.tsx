import { ActionIcon, Checkbox, Popover, Stack, Tooltip } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { memo, type ReactNode } from "react";

import { localized } from "../language/localized";
import { IconFit, IconLayers, IconMinus, IconPlus, IconRuler } from "../ui/icons";
import { type MapLayers, showLayer, useMapLayers } from "./mapLayers";

const NAMES = localized((): Record<keyof MapLayers, string> => ({
  grid: t`Grid with coordinates`,
  names: t`Names of roads and junctions`,
  nodes: t`Start points and lane graph, when near`,
  signs: t`Signs and traffic lights`,
  buildings: t`Buildings`,
  overview: t`Overview map`,
}));

/** Buttons on a map: what it shows, how far and how large. */
export const MapButtons = memo(function MapButtons({
  onZoom,
  onAll,
  measuring,
  onMeasure,
}: {
  onZoom: (factor: number) => void;
  onAll: () => void;
  measuring: boolean;
  onMeasure: () => void;
}) {
  return (
    <div className="map-buttons">
      <LayersButton />
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

function LayersButton() {
  const layers = useMapLayers();
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
          {(Object.keys(NAMES()) as (keyof MapLayers)[]).map((name) => (
            <Checkbox
              key={name}
              size="sm"
              label={NAMES()[name]}
              checked={layers[name]}
              onChange={({ currentTarget: { checked } }) => showLayer(name, checked)}
            />
          ))}
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
