import { Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type KeyboardEvent, useEffect, useRef, useState } from "react";

import type { GroupPair, LightProgram } from "../api/signals";
import { parsed, short } from "../language/numbers";
import type { SignalEditing, Timing } from "./editing";
import { Refused } from "./Refused";
import { type Attempt, useAttempt } from "./useAttempt";

const ROWS: Record<string, [number, number]> = {
  ArrowUp: [-1, 0],
  ArrowDown: [1, 0],
};

/** Seconds from the end of green of a group to the begin of another: what is set above what the paths need. */
export function IntergreenMatrix({
  light,
  junction,
  timing,
  editing,
}: {
  light: LightProgram;
  junction: string;
  timing: Timing;
  editing: SignalEditing;
}) {
  const attempt = useAttempt(editing);
  const ids = timing.groups.map(({ id }) => id);
  const pairs = new Map(light.pairs.map((one) => [`${one.ending} ${one.beginning}`, one]));
  const flagged = light.pairs.filter(tooShort);
  /** The next field above or below. */
  const move = (event: KeyboardEvent<HTMLInputElement>): void => {
    const step = ROWS[event.key];
    if (!step) return;
    event.preventDefault();
    const cell = event.currentTarget.closest("td");
    let row = cell?.parentElement;
    while (row && cell) {
      row = (step[0] < 0 ? row.previousElementSibling : row.nextElementSibling) as HTMLElement | null;
      const field = row?.children[cell.cellIndex]?.querySelector("input");
      if (field) return field.focus();
    }
  };
  return (
    <div className="signal-forms">
      <Text size="xs" c="dimmed">
        <Trans>
          Rows (↓) clear, columns (→) enter. The small number is what the paths need; an empty field keeps to
          it.
        </Trans>
      </Text>
      <div className="signal-matrix" tabIndex={0} role="region" aria-label={t`Matrix of intergreens`}>
        <table>
          <thead>
            <tr>
              <td aria-hidden="true">↓ →</td>
              {ids.map((id) => (
                <th key={id} scope="col">
                  {id}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {ids.map((ending) => (
              <tr key={ending}>
                <th scope="row">{ending}</th>
                {ids.map((beginning) => {
                  const pair = pairs.get(`${ending} ${beginning}`);
                  return (
                    <td key={beginning} data-same={ending === beginning || undefined}>
                      {pair && (pair.needed > 0 || pair.given !== null) && (
                        <Cell pair={pair} junction={junction} attempt={attempt} onKey={move} />
                      )}
                    </td>
                  );
                })}
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      <Refused by={attempt} />
      {flagged.map(({ ending, beginning, used, needed }) => (
        <Text key={`${ending} ${beginning}`} size="sm" className="signal-refused">
          {t`${ending} to ${beginning}: ${short(used, 1)} s are shorter than the ${short(needed, 1)} s that the paths need.`}
        </Text>
      ))}
    </div>
  );
}

const tooShort = ({ used, needed }: GroupPair): boolean => used < needed - 1e-6;

function Cell({
  pair,
  junction,
  attempt,
  onKey,
}: {
  pair: GroupPair;
  junction: string;
  attempt: Attempt;
  onKey: (event: KeyboardEvent<HTMLInputElement>) => void;
}) {
  const { ending, beginning, needed, given } = pair;
  const saved = given === null ? "" : short(given, 1);
  const [text, setText] = useState(saved);
  const [wrong, setWrong] = useState(false);
  const asked = useRef(saved);
  useEffect(() => {
    setText(saved);
    setWrong(false);
    asked.current = saved;
  }, [saved]);
  const commit = async (): Promise<void> => {
    if (text.trim() === asked.current) return;
    const value = parsed(text);
    if (text.trim() !== "" && !(value >= 0 && value <= 3600)) {
      setWrong(true);
      return attempt.say(t`An intergreen is a number of seconds.`);
    }
    asked.current = text.trim();
    const seconds = text.trim() === "" ? null : value;
    setWrong(!(await attempt.ask([{ kind: "set_intergreen", junction, ending, beginning, seconds }])));
  };
  return (
    <>
      <input
        inputMode="decimal"
        aria-label={t`Intergreen from ${ending} to ${beginning}, seconds; the paths need ${short(needed, 1)}`}
        data-set={given !== null || undefined}
        aria-invalid={wrong || tooShort(pair)}
        placeholder={short(pair.used, 1)}
        value={text}
        maxLength={6}
        onChange={(event) => setText(event.currentTarget.value)}
        onBlur={() => void commit()}
        onKeyDown={(event) => {
          if (event.key === "Enter") void commit();
          else if (event.key === "Escape" && text !== saved) {
            // The panel stays open.
            event.stopPropagation();
            setText(saved);
            setWrong(false);
            asked.current = saved;
            attempt.say(null);
          } else onKey(event);
        }}
      />
      <small aria-hidden="true">{short(needed, 1)}</small>
    </>
  );
}
