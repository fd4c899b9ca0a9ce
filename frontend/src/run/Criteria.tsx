import { Button, Text, Title } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { short } from "../language/numbers";
import type { CriterionInfo } from "../api/runs";
import { clock } from "../language/moments";
import { i18n } from "@lingui/core";
import { actorMeasures, allFigures } from "../api/figures";
import { criterionWords } from "../editor/criteria";
import { useLoaded } from "../ui/useLoaded";

/** What the scenario asked of the run: met or not, the value, and its moment in the recording. */
export function Criteria({
  criteria,
  onShow,
}: {
  criteria: readonly CriterionInfo[];
  /** Shows a second of the run in the recording; null without one. */
  onShow: ((time: number) => void) | null;
}) {
  const run = useLoaded(allFigures).value;
  const actors = useLoaded(actorMeasures).value;
  if (criteria.length === 0) return null;
  const missed = criteria.filter(({ passed }) => !passed).length;
  return (
    <section aria-label={t`Criteria`} style={{ marginTop: 14 }}>
      <Title order={3} size="h5">
        {missed === 0 ? t`All criteria are met` : t`${missed} of ${criteria.length} criteria not met`}
      </Title>
      <ul className="criteria">
        {criteria.map(({ criterion, words: said, passed, value, unit, time }) => {
          const own = criterionWords(criterion, { run: run ?? [], actors: actors ?? [] });
          // In English, and where the measure is not known here, as reports say it.
          const words = i18n.locale === "en" || own === criterion ? said : own;
          return (
            <li key={criterion}>
              <strong data-met={passed}>{passed ? t`Met` : t`Not met`}:</strong> {words}
              <Text size="sm" c="dimmed" component="span">
                {value === null ? t` (not measured)` : t`, is ${rounded(value)}${unit ? ` ${unit}` : ""}`}
                {time !== null && !onShow && t` at ${clock(time)}`}
              </Text>
              {time !== null && onShow && (
                <Button
                  size="compact-xs"
                  variant="default"
                  ml={6}
                  aria-label={t`Show ${words} at ${clock(time)}`}
                  onClick={() => onShow(time)}
                >
                  {clock(time)}
                </Button>
              )}
            </li>
          );
        })}
      </ul>
    </section>
  );
}

const rounded = (value: number): string => short(value, 2);
