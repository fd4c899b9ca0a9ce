import { Button, Group, Modal, NumberInput, Select, Text } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { api } from "../api/client";
import { studies } from "../api/studies";
import { likelyBefore } from "../experiments/plan";
import { go } from "../ui/address";
import { tellError } from "../ui/notices";
import { useLoaded } from "../ui/useLoaded";

/** Seeds that are enough to see most differences. */
const SEEDS = 10;
const PROCESSES = 2;

/** Compares the scenario with another one: both run with the same random seeds, and their figures are paired. */
export function CompareDialog({ scenario, onClose }: { scenario: string; onClose: () => void }) {
  const { value } = useLoaded(api.scenarios);
  const [chosen, setChosen] = useState<string | null>(null);
  const [seeds, setSeeds] = useState(SEEDS);
  const [starting, setStarting] = useState(false);
  const others = (value ?? []).filter(({ name, error }) => name !== scenario && error === null);
  const other =
    chosen ??
    likelyBefore(
      scenario,
      others.map(({ name }) => name),
    );
  const start = (): void => {
    if (other === null) return;
    setStarting(true);
    // The other one is what it was before.
    studies.start({ scenarios: [other, scenario], seeds, weather: [], processes: PROCESSES }).then(
      ({ study }) => go({ view: "study", study }),
      (reason: unknown) => {
        setStarting(false);
        tellError(reason);
      },
    );
  };
  return (
    <Modal opened onClose={onClose} title={t`Compare with another scenario`}>
      <Text size="sm" mb="sm">
        <Trans>
          Both are run with the same random seeds. The results say by how much each figure of this scenario
          differs from the other one, with a 95 % interval.
        </Trans>
      </Text>
      {value && others.length === 0 ? (
        <Text size="sm">
          <Trans>There is no other scenario. “Save as …” makes one to change.</Trans>
        </Text>
      ) : (
        <>
          <Select
            label={t`Compare with`}
            data-autofocus
            placeholder={t`Choose a scenario`}
            data={others.map(({ name, title }) => ({
              value: name,
              label: title == null || title === name ? name : `${title} (${name})`,
            }))}
            value={other}
            searchable
            onChange={setChosen}
          />
          <NumberInput
            mt="sm"
            label={t`Random seeds`}
            min={2}
            max={1000}
            allowDecimal={false}
            value={seeds}
            onChange={(next) => setSeeds(Math.max(2, Number(next) || 2))}
          />
        </>
      )}
      <Group justify="flex-end" mt="lg">
        <Button variant="default" onClick={onClose}>
          <Trans>Cancel</Trans>
        </Button>
        <Button loading={starting} disabled={other === null} onClick={start}>
          {t`Start ${plural(2 * seeds, { one: "# run", other: "# runs" })}`}
        </Button>
      </Group>
    </Modal>
  );
}
