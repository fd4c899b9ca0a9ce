import { Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useEffect, useRef } from "react";

import type { Detector, LightProgram } from "../api/signals";
import { lengthText } from "../language/units";
import type { ApproachNames } from "../map/placeNames";
import type { Sight } from "./occupancy";

/** What the server has drawn: names in it are escaped there. */
export function Drawn({ svg, className }: { svg: string; className?: string }) {
  return <div className={className} dangerouslySetInnerHTML={{ __html: svg }} />;
}

interface Seen {
  light: LightProgram;
  sight: Sight | null;
}

/** The junction, with the detectors filled that are occupied. */
export function JunctionPicture({ light, sight }: Seen) {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    for (const shape of box.current?.querySelectorAll<SVGElement>("[data-detector]") ?? [])
      shape.classList.toggle("occupied", sight?.on.has(shape.dataset.detector ?? "") ?? false);
  }, [light, sight]);
  return (
    <div ref={box}>
      <Drawn className="signal-site" svg={light.site} />
    </div>
  );
}

interface Loops {
  label: string;
  purpose: string;
  loops: Detector[];
}

export function DetectorTable({ light, sight }: Seen) {
  if (light.detectors.length === 0)
    return (
      <Text size="sm" c="dimmed">
        <Trans>No detectors: fixed-time control needs none.</Trans>
      </Text>
    );
  const rows: Loops[] = [];
  for (const one of light.detectors) {
    const purpose = purposeOf(one);
    const row = rows.find((other) => other.label === one.label && other.purpose === purpose);
    if (row) row.loops.push(one);
    else rows.push({ label: one.label, purpose, loops: [one] });
  }
  return (
    <table className="signal-table" aria-label={t`Detectors`}>
      <thead>
        <tr>
          <th scope="col">
            <Trans>Detector</Trans>
          </th>
          <th scope="col">
            <Trans>Place</Trans>
          </th>
          <th scope="col">
            <Trans>For</Trans>
          </th>
          {sight && (
            <th scope="col">
              <Trans>Now</Trans>
            </th>
          )}
        </tr>
      </thead>
      <tbody>
        {rows.map(({ label, purpose, loops }) => (
          <tr key={`${label} ${purpose}`}>
            <th scope="row">{label}</th>
            <td>{placeWords(loops)}</td>
            <td>{purpose}</td>
            {sight && <td>{sight.words(loops)}</td>}
          </tr>
        ))}
      </tbody>
    </table>
  );
}

const placeWords = (loops: readonly Detector[]): string => {
  const [first] = loops;
  if (!first || first.call) return t`where people wait`;
  const lanes = loops.length > 1 ? t`, ${loops.length} lanes` : "";
  if (first.bus) return t`last ${lengthText(first.length)} before the stop line${lanes}`;
  return t`${lengthText(first.ahead)} before the stop line${lanes}`;
};

function purposeOf({ call, bus, stages }: Detector): string {
  const named = stages.join(", ");
  if (call) return t`calls stage ${named}`;
  return bus ? t`priority in stage ${named}` : t`prolongs stage ${named}`;
}

export function GroupTable({ light, names }: { light: LightProgram; names: ApproachNames }) {
  return (
    <details>
      <summary>
        <Trans>Signal groups and their movements</Trans>
      </summary>
      <table className="signal-table" aria-label={t`Signal groups`}>
        <thead>
          <tr>
            <th scope="col">
              <Trans>Group</Trans>
            </th>
            <th scope="col">
              <Trans>Movements</Trans>
            </th>
          </tr>
        </thead>
        <tbody>
          {light.groups.map(({ id, movements }) => (
            <tr key={id}>
              <th scope="row">{id}</th>
              <td>{names.movements(movements)}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </details>
  );
}
