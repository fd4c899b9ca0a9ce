import { Loader, RangeSlider, Select, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { nth } from "../lists";
import { span as spanText } from "../language/moments";
import { LANES_BY, type LanesBy, QUANTITIES } from "./laneUse";
import type { ShownUse } from "./useLaneUse";

const NOTHING = "nothing";
/** Room for the longest choice, and for each letter of the word before it and its edges, pixels. */
const [VALUE, LETTER, EDGES] = [158, 6.5, 20];

/** Chooses what the colours of lanes say, and of which part of the run. */
export function LaneTools({ shown }: { shown: ShownUse }) {
  const { by, choose, times, span, setSpan, pointed, failure } = shown;
  const word = t`Lanes`;
  const named = Math.round(LETTER * word.length + EDGES);
  const last = times.length - 1;
  const whole = span[0] === 0 && span[1] === last;
  return (
    <>
      <Select
        className="lane-choice"
        size="xs"
        w={VALUE + named}
        aria-label={t`Colour the lanes by`}
        leftSection={<span aria-hidden="true">{word}</span>}
        leftSectionWidth={named}
        allowDeselect={false}
        data={[
          { value: NOTHING, label: t({ message: "Plain", context: "lanes without colours" }) },
          ...LANES_BY.map((value) => ({ value, label: QUANTITIES()[value].word })),
        ]}
        value={by ?? NOTHING}
        onChange={(next) => choose(next === NOTHING ? null : (next as LanesBy))}
      />
      {by && (
        <div className="lane-tools">
          {failure !== null && (
            <Text size="xs" role="alert">
              {failure}
            </Text>
          )}
          {failure === null && last < 1 && <Loader size="xs" aria-label={t`Loading the lanes`} />}
          {last > 0 && (
            <>
              <Text size="xs" aria-live="polite">
                {whole ? t`Whole run` : spanText(nth(times, span[0]), nth(times, span[1]))}
              </Text>
              {last > 1 && (
                <RangeSlider
                  size="sm"
                  my={8}
                  min={0}
                  max={last}
                  step={1}
                  minRange={1}
                  label={null}
                  thumbFromLabel={t`Begin of what colours of lanes show`}
                  thumbToLabel={t`End of what colours of lanes show`}
                  value={[...span]}
                  onChange={setSpan}
                />
              )}
              <Text size="xs" aria-live="polite" data-hint={pointed === null || undefined}>
                {pointed ? (
                  <Trans>
                    Lane {pointed.lane}: {pointed.value}
                  </Trans>
                ) : (
                  <Trans>Point at a lane to read its value.</Trans>
                )}
              </Text>
            </>
          )}
        </div>
      )}
    </>
  );
}
