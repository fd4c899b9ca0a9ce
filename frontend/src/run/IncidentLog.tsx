import { Text } from "@mantine/core";

import type { Incident } from "../api/runs";
import type { Category } from "../api/types";
import { MARK_COLOR } from "../map/colors";
import { clock } from "../ui/words";
import { markKind, sentence } from "./incidents";

const LISTED = 200;

/** What went wrong on the road, the newest first; a click shows the place. */
export function IncidentLog({ incidents, categories, over, onShow }: {
  incidents: readonly Incident[]; categories: ReadonlyMap<string, Category>; over: boolean; onShow: (incident: Incident) => void;
}) {
  if (incidents.length === 0) {
    return <Text size="sm" c="dimmed">{over ? "Nothing went wrong on the road." : "Nothing has gone wrong so far. Collisions, emergency braking and teleports (removed after waiting too long) appear here."}</Text>;
  }
  const listed = incidents.slice(-LISTED).reverse();
  return (
    <>
      <Text size="sm" c="dimmed">Choose one to see where it happened.</Text>
      <ul className="rows" aria-label="What happened">
        {listed.map((one, n) => (
          <li key={incidents.length - n}>
            <button type="button" onClick={() => onShow(one)}>
              <i className="mark" style={{ background: MARK_COLOR[markKind(one)] }} />
              <time>{clock(one.time)}</time>
              <span>{sentence(one, categories)}</span>
            </button>
          </li>
        ))}
      </ul>
      {incidents.length > LISTED && <Text size="sm" c="dimmed" mt="xs">{(incidents.length - LISTED).toLocaleString("en")} earlier ones are in the report.</Text>}
    </>
  );
}
