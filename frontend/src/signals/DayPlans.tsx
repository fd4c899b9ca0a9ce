import { ActionIcon, Button, Group, Select, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import type { LightProgram } from "../api/signals";
import type { Edit } from "../api/types";
import { Committed } from "../editor/Committed";
import { CommittedText } from "../editor/FormParts";
import { dayTime, parsedDayTime } from "../language/units";
import { IconTrash } from "../ui/icons";
import { DayBar } from "./DayBar";
import { clockOf, type Plan, type Switch, switchesOf, withTimes } from "./day";
import type { SignalEditing, Timing } from "./editing";
import { Refused } from "./Refused";
import { useAttempt } from "./useAttempt";

interface Props {
  light: LightProgram;
  junction: string;
  timing: Timing;
  editing: SignalEditing;
}

const newPlan = (junction: string, plan: string, time: number): Edit => ({
  kind: "set_plan",
  junction,
  plan,
  times: [clockOf(time)],
});

/** Seconds of the day: the first division is the morning peak and the rest of the day. */
const [PEAK, PEAK_OVER] = [6 * 3600, 9 * 3600];

/** When which plan runs, and the cycle and offset of each. */
export function DayPlans({ light, junction, timing, editing }: Props) {
  const { plans } = timing;
  const attempt = useAttempt(editing);
  const switches = switchesOf(plans);
  const ids = plans.map(({ id }) => id);
  const planOf = (id: string): Plan | undefined => plans.find((one) => one.id === id);
  const move = async ({ time, plan }: Switch, to: number): Promise<boolean> => {
    const one = planOf(plan);
    return one ? attempt.ask([withTimes(junction, one, { without: time, also: to })]) : false;
  };
  const give = ({ time }: Switch, plan: string): void => {
    const one = planOf(plan);
    if (one) void attempt.ask([withTimes(junction, one, { also: time })]);
  };
  const take = ({ time, plan }: Switch): void => {
    const one = planOf(plan);
    if (!one) return;
    // A plan that never begins is none.
    if (one.times.length > 1) void attempt.ask([withTimes(junction, one, { without: time })]);
    else void attempt.ask([{ kind: "remove_plan", junction, plan }]);
  };
  if (plans.length === 0)
    return (
      <div className="signal-forms">
        <Text size="sm" c="dimmed">
          <Trans>One plan runs all day.</Trans>
        </Text>
        <Button
          size="compact-sm"
          variant="default"
          style={{ justifySelf: "start" }}
          onClick={() =>
            void attempt.ask(
              [
                { kind: "set_plan", junction, plan: "B", times: [clockOf(0), clockOf(PEAK_OVER)] },
                { kind: "set_plan", junction, plan: "A", times: [clockOf(PEAK)] },
              ],
              t`Plans of the day of light ${junction}`,
            )
          }
        >
          <Trans>Divide the day: A from 6 to 9 o’clock, else B</Trans>
        </Button>
        <Refused by={attempt} />
      </div>
    );
  return (
    <div className="signal-forms">
      <DayBar switches={switches} plans={ids} onMove={move} />
      <table className="signal-table" aria-label={t`Plans over the day`}>
        <thead>
          <tr>
            <th scope="col">
              <Trans>From</Trans>
            </th>
            <th scope="col">
              <Trans>Plan of the day</Trans>
            </th>
            <td />
          </tr>
        </thead>
        <tbody>
          {switches.map((one) => (
            <tr key={`${one.time} ${one.plan}`}>
              <td>
                <TimeField
                  label={t`${one.plan} begins at`}
                  time={one.time}
                  onTime={(time) => void move(one, time)}
                  onWrong={attempt.say}
                />
              </td>
              <td>
                <Select
                  size="xs"
                  aria-label={t`Plan from ${dayTime(one.time)}`}
                  data={ids}
                  value={one.plan}
                  allowDeselect={false}
                  onChange={(plan) => {
                    if (plan) give(one, plan);
                  }}
                />
              </td>
              <td>
                <ActionIcon
                  variant="subtle"
                  color="gray"
                  aria-label={t`Remove ${one.plan} from ${dayTime(one.time)}`}
                  onClick={() => take(one)}
                >
                  <IconTrash />
                </ActionIcon>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
      <NewTime ids={ids} junction={junction} timing={timing} editing={editing} />
      <Refused by={attempt} />
      {plans.map((plan) => (
        <PlanForm
          key={plan.id}
          plan={plan}
          light={light}
          junction={junction}
          timing={timing}
          editing={editing}
        />
      ))}
      <Text size="xs" c="dimmed">
        <Trans>The greens of a plan are changed above, in the bar of the plan that is shown.</Trans>
      </Text>
    </div>
  );
}

function TimeField({
  label,
  time,
  onTime,
  onWrong,
}: {
  label: string;
  time: number;
  onTime: (time: number) => void;
  onWrong: (words: string) => void;
}) {
  const commit = (text: string): void => {
    if (text === dayTime(time)) return;
    const found = parsedDayTime(text);
    if (found === null) onWrong(t`A time of the day is wanted, such as ${dayTime(PEAK)}.`);
    else onTime(found);
  };
  return (
    <TextInput
      key={time}
      size="xs"
      aria-label={label}
      defaultValue={dayTime(time)}
      maxLength={8}
      onBlur={(event) => commit(event.currentTarget.value)}
      onKeyDown={(event) => {
        if (event.key === "Enter") commit(event.currentTarget.value);
      }}
    />
  );
}

/** Lets a plan that is there, or a new one, take over at one more time. */
function NewTime({ ids, junction, timing, editing }: Omit<Props, "light"> & { ids: readonly string[] }) {
  const attempt = useAttempt(editing);
  const [time, setTime] = useState("");
  const [plan, setPlan] = useState("");
  const add = async (): Promise<void> => {
    const found = parsedDayTime(time);
    if (found === null) return attempt.say(t`A time of the day is wanted, such as ${dayTime(PEAK)}.`);
    const known = timing.plans.find(({ id }) => id === plan.trim());
    const made = known ? withTimes(junction, known, { also: found }) : newPlan(junction, plan.trim(), found);
    if (!(await attempt.ask([made]))) return;
    setTime("");
    setPlan("");
  };
  return (
    <>
      <Group gap="xs" align="flex-end" wrap="nowrap" grow>
        <TextInput
          size="xs"
          label={t`From`}
          placeholder={dayTime(PEAK)}
          value={time}
          onChange={(event) => setTime(event.currentTarget.value)}
        />
        <TextInput
          size="xs"
          label={t`Plan, or a new name`}
          placeholder={ids[0] ?? "A"}
          value={plan}
          maxLength={64}
          onChange={(event) => setPlan(event.currentTarget.value)}
        />
      </Group>
      <Button
        size="compact-sm"
        style={{ justifySelf: "start" }}
        variant="default"
        disabled={!time.trim() || !plan.trim()}
        onClick={() => void add()}
      >
        <Trans>Add the time</Trans>
      </Button>
      <Refused by={attempt} />
    </>
  );
}

function PlanForm({ plan, light, junction, timing, editing }: Props & { plan: Plan }) {
  const { id } = plan;
  const attempt = useAttempt(editing);
  const shown = light.plans.find((one) => one.id === id);
  const rename = (name: string): void => {
    if (timing.plans.some((one) => one.id === name)) attempt.say(t`${name} is taken`);
    else if (name === "") attempt.say(t`A plan needs a name`);
    else void attempt.ask([{ kind: "set_plan", junction, plan: id, id: name }]);
  };
  return (
    <section className="fold" aria-label={t`Plan ${id}`}>
      <Group grow gap="xs" align="flex-end" wrap="nowrap">
        <CommittedText label={t`Name`} value={id} maxLength={64} onCommit={rename} />
        <Committed
          label={t`Cycle`}
          suffix={" s"}
          min={1}
          max={3600}
          digits={1}
          value={shown?.cycle ?? ""}
          onCommit={(seconds) => {
            if (seconds !== null) void editing.retime({ is: "cycle" }, seconds, id, false);
          }}
        />
        <Committed
          label={t`Offset`}
          suffix={" s"}
          min={0}
          max={3600}
          digits={1}
          value={plan.offset}
          onCommit={(offset) =>
            void attempt.ask([{ kind: "set_plan", junction, plan: id, offset: offset ?? 0 }])
          }
        />
      </Group>
      <Refused by={attempt} />
    </section>
  );
}
