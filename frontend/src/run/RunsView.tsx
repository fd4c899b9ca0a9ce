import { Anchor, Title } from "@mantine/core";
import { Trans } from "@lingui/react/macro";
import { useCallback } from "react";

import { api } from "../api/client";
import { hashOf } from "../ui/address";
import { useLearnedTitle, useTitle } from "../ui/titles";
import { useLoaded } from "../ui/useLoaded";
import { EarlierRuns } from "./EarlierRuns";
import "./run.css";

/** The runs of one scenario by themselves. */
export function RunsView({ scenario }: { scenario: string }) {
  const load = useCallback(() => api.scenario(scenario), [scenario]);
  useLearnedTitle(scenario, useLoaded(load).value?.document.name);
  const title = useTitle(scenario);
  return (
    <div className="runs-view">
      <Title order={1} size="h2" mb="md">
        <Trans>Runs of {title}</Trans>
      </Title>
      <EarlierRuns scenario={scenario} />
      <Anchor display="inline-block" mt="lg" href={hashOf({ view: "editor", scenario })}>
        <Trans>Back to the editor</Trans>
      </Anchor>
    </div>
  );
}
