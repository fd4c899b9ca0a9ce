import { Alert } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { useCallback } from "react";

import { type Chosen, models, type Offered } from "../api/models";
import { served } from "../language/served";
import { useLoaded } from "../ui/useLoaded";
import { ModelChoice } from "./ModelChoice";

/** SUMO is what plays a run unless another is chosen; to mirror one in CARLA there is a switch. */
const others = (): Promise<Offered[]> =>
  models.simulators().then((all) => all.filter(({ name }) => name !== "sumo" && name !== "carla-mirror"));

const simulatorWords = (name: string): string => {
  if (name === "carla-native") return t`CARLA alone`;
  return name === "metadrive" ? "MetaDrive" : name;
};

/** What plays the scenario, and what of it that simulator does not do. */
export function SimulatorChoice({
  scenario,
  version,
  chosen,
  onChange,
}: {
  scenario: string;
  version: number;
  chosen: Chosen | null;
  onChange: (chosen: Chosen | null) => void;
}) {
  return (
    <>
      <ModelChoice
        offered={others}
        label={t`Simulator`}
        none="SUMO"
        words={simulatorWords}
        unusable={t`This simulator cannot be used`}
        chosen={chosen}
        onChange={onChange}
      />
      {chosen && (
        <Unsupported key={`${chosen.name} ${version}`} simulator={chosen.name} scenario={scenario} />
      )}
    </>
  );
}

function Unsupported({ simulator, scenario }: { simulator: string; scenario: string }) {
  const load = useCallback(() => models.unsupported(simulator, scenario), [simulator, scenario]);
  const problems = useLoaded(load);
  if (!problems.value?.length) return null;
  return (
    <Alert color="yellow" title={t`Not done by this simulator`}>
      <ul>
        {problems.value.map(({ where, message }) => (
          <li key={`${where} ${message}`}>{served(message)}</li>
        ))}
      </ul>
    </Alert>
  );
}
