import { Alert, Anchor, Button, Loader, MultiSelect, NumberInput, Text, TextInput } from "@mantine/core";
import { useState } from "react";

import { api } from "../api/client";
import { studies } from "../api/studies";
import { go, hashOf } from "../ui/address";
import { tellError } from "../ui/notices";
import { useLoaded } from "../ui/useLoaded";
import { count, weatherWord } from "../ui/words";

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
      <Alert color="red" title="The scenarios cannot be shown">
        {error}
      </Alert>
    );
  if (!scenarios) return <Loader aria-label="Loading the scenarios" />;
  const whole = scenarios.filter((one) => one.error === null);
  if (whole.length === 0)
    return (
      <Text>
        A study runs your scenarios, and there are none yet.{" "}
        <Anchor href={hashOf({ view: "catalogue" })}>Make one</Anchor> first.
      </Text>
    );
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
      aria-label="New study"
      onSubmit={(event) => {
        event.preventDefault();
        start();
      }}
    >
      <MultiSelect
        label="Scenarios"
        placeholder={chosen.length === 0 ? "Choose scenarios" : ""}
        data={whole.map((one) => ({ value: one.name, label: one.title ?? one.name }))}
        value={chosen}
        onChange={setChosen}
        searchable
        clearable
      />
      <MultiSelect
        label="Weather, besides that of each scenario"
        description="Each is a variant of every scenario; the results have its differences."
        data={(assets?.weather ?? []).map((one) => ({ value: one.name, label: weatherWord(one) }))}
        value={weather}
        onChange={setWeather}
        searchable
        clearable
      />
      <div className="plan-fields">
        <NumberInput
          label="Seeds"
          description="Runs of each, with other chance"
          min={1}
          max={10_000}
          allowDecimal={false}
          value={seeds}
          onChange={(next) => setSeeds(Math.max(1, Number(next) || 1))}
        />
        <NumberInput
          label="Minutes of each run"
          description="Empty: as the scenario says"
          min={0.1}
          value={minutes ?? ""}
          onChange={(next) => setMinutes(Number(next) > 0 ? Number(next) : null)}
        />
        <NumberInput
          label="At a time"
          description="At most one for each core"
          min={1}
          max={256}
          allowDecimal={false}
          value={processes}
          onChange={(next) => setProcesses(Math.max(1, Number(next) || 1))}
        />
        <TextInput
          label="Name"
          placeholder="After the first scenario"
          maxLength={64}
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
      </div>
      <div>
        <Button type="submit" loading={starting} disabled={chosen.length === 0}>
          {chosen.length === 0 ? "Start the study" : `Start ${count(runs, "run")}`}
        </Button>
      </div>
    </form>
  );
}
