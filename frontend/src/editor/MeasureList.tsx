import { Text } from "@mantine/core";

import { Trans } from "@lingui/react/macro";
import type { PlaceNames } from "../map/placeNames";
import type { Measure } from "./measures";
import { inWords } from "./measures";

/** The measures of the scenario, with begin and end; their places are orange on the map. */
export function MeasureList({ measures, places }: { measures: readonly Measure[]; places: PlaceNames }) {
  if (measures.length === 0) return null;
  return (
    <section aria-labelledby="measures">
      <Text id="measures" size="sm" fw={500}>
        <Trans>Measures</Trans>
      </Text>
      <ul style={{ margin: 0, paddingLeft: 18 }}>
        {measures.map((measure) => {
          const { title, detail, when } = inWords(measure, places);
          return (
            <li key={measure.id}>
              <Text size="sm">{title}</Text>
              <Text size="xs" c="dimmed">
                {detail}; {when}
              </Text>
            </li>
          );
        })}
      </ul>
    </section>
  );
}
