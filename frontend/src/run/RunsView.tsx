import { Anchor, Title } from "@mantine/core";

import { hashOf } from "../ui/address";
import { EarlierRuns } from "./EarlierRuns";

/** The runs of one scenario by themselves. */
export function RunsView({ scenario }: { scenario: string }) {
  return (
    <div className="runs-view">
      <Title order={1} size="h2" mb="md">
        Runs of {scenario}
      </Title>
      <EarlierRuns scenario={scenario} />
      <Anchor display="inline-block" mt="lg" href={hashOf({ view: "editor", scenario })}>
        Back to the editor
      </Anchor>
    </div>
  );
}
