import { Alert, Button, Group, Title } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useStarter } from "../editor/asked";
import { go } from "../ui/address";

/** Instead of a run that cannot be shown: why, and what can be done. */
export function RunGone({
  scenario,
  reason,
  watched,
}: {
  scenario: string;
  reason: string;
  /** Whether it was seen before it was gone. */
  watched: boolean;
}) {
  const { busy, start } = useStarter(scenario);
  return (
    <div className="catalogue">
      <Title order={1} size="h3" mb="sm">
        {watched ? t`This run is gone` : t`This run cannot be shown`}
      </Title>
      <Alert color="red">
        {watched
          ? t`It was removed, or the server was ended by force while it was running, and nothing of it is kept. The scenario is as it was; run again, it gives the same results.`
          : reason}
      </Alert>
      <Group mt="md" gap="xs">
        <Button onClick={() => go({ view: "editor", scenario })}>
          <Trans>Back to the editor</Trans>
        </Button>
        {watched && (
          <Button variant="default" loading={busy} onClick={() => start({ scenario, speed: 1 })}>
            <Trans>Run again</Trans>
          </Button>
        )}
      </Group>
    </div>
  );
}
