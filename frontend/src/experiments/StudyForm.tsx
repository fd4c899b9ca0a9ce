import { Alert, Anchor, Button, Loader, MultiSelect, NumberInput, Text, TextInput } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { api } from "../api/client";
import { studies } from "../api/studies";
import { scenarioLabels } from "../catalogue/titles";
import { nth } from "../lists";
import { go, hashOf } from "../ui/address";
import { tellError } from "../ui/notices";
import { useLoaded } from "../ui/useLoaded";
import { weatherWord } from "../ui/words";

/** Which scenarios, how often, in which weather. */
export function StudyForm() {
  const { value: scenarios, error } = useLoaded(api.scenarios);
  const { value: assets } = useLoaded(api.assets);
  const [name, setName] = useState("");
  const [chosen, setChosen] = useState<string[]>([]);
  const [weather, setWeather] = useState<string[]>([]);
  const [seeds, setSeeds] = useState(10);
  const [minutes, setMinutes] = useState<number | null>(null);
  const [processes, setProcesses] = useState(2);
  const [starting, setStarting] = useState(false);
  if (error)
    return (
      <Alert color="red" title={t`The scenarios cannot be shown`}>
        {error}
      </Alert>
    );
  if (!scenarios) return <Loader aria-label={t`Loading the scenarios`} />;
  const whole = scenarios.filter((one) => one.error === null);
  if (whole.length === 0)
    return (
      <Text>
        <Trans>
          A study runs your scenarios, and there are none yet.{" "}
          <Anchor href={hashOf({ view: "catalogue" })}>
            <Trans>Make one</Trans>
          </Anchor>{" "}
          first.
        </Trans>
      </Text>
    );
  const labels = scenarioLabels(whole);
  const runs = chosen.length * (1 + weather.length) * seeds;
  const start = (): void => {
    setStarting(true);
    studies
      .start({
        name: name.trim() || null,
        scenarios: chosen,
        seeds,
        weather,
        until: minutes === null ? null : 60 * minutes,
        processes,
      })
      .then(
        ({ study }) => go({ view: "study", study }),
        (reason: unknown) => {
          setStarting(false);
          tellError(reason);
        },
      );
  };
  return (
    <form
      className="plan-form"
      aria-label={t`New study`}
      onSubmit={(event) => {
        event.preventDefault();
        start();
      }}
    >
      <MultiSelect
        label={t`Scenarios`}
        placeholder={chosen.length === 0 ? t`Choose scenarios` : ""}
        data={whole.map((one, n) => ({ value: one.name, label: nth(labels, n) }))}
        value={chosen}
        onChange={setChosen}
        searchable
        clearable
      />
      <MultiSelect
        label={t`Weather, besides that of each scenario`}
        description={t`Each is a variant of every scenario; the results have its differences.`}
        data={(assets?.weather ?? []).map((one) => ({ value: one.name, label: weatherWord(one) }))}
        value={weather}
        onChange={setWeather}
        searchable
        clearable
      />
      <div className="plan-fields">
        <NumberInput
          label={t`Seeds`}
          description={t`Replications per scenario`}
          min={1}
          max={10_000}
          allowDecimal={false}
          value={seeds}
          onChange={(next) => setSeeds(Math.max(1, Number(next) || 1))}
        />
        <NumberInput
          label={t`Minutes of each run`}
          description={t`Empty: as the scenario says`}
          min={0.1}
          value={minutes ?? ""}
          onChange={(next) => setMinutes(Number(next) > 0 ? Number(next) : null)}
        />
        <NumberInput
          label={t`Parallel runs`}
          description={t`At most one for each core`}
          min={1}
          max={256}
          allowDecimal={false}
          value={processes}
          onChange={(next) => setProcesses(Math.max(1, Number(next) || 1))}
        />
        <TextInput
          label={t`Name`}
          placeholder={t`After the first scenario`}
          maxLength={64}
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
      </div>
      <div>
        <Button type="submit" loading={starting} disabled={chosen.length === 0}>
          {chosen.length === 0
            ? t`Start the study`
            : t`Start ${plural(runs, { one: "# run", other: "# runs" })}`}
        </Button>
      </div>
    </form>
  );
}
