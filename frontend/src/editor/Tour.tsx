import { Button, CloseButton, Group, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useEffect, useRef, useState } from "react";

import { localized } from "../language/localized";
import { nth } from "../lists";
import { closesList } from "../ui/lists";
import type { Step } from "./scene";

const KEY = "odscen.tour";
const STEPS = localized((): readonly [title: string, text: string][] => [
  [
    t`1. Choose where`,
    t`Click a road or junction: it is the first segment of your region. Light-blue segments can be added.`,
  ],
  [
    t`2. Choose who`,
    t`Open “Road users”, choose a kind and click a lane for vehicles, a sidewalk for pedestrians.`,
  ],
  [
    t`3. Run it`,
    t`Open “Run” and press Run to watch the traffic. Every change is saved automatically and can be undone.`,
  ],
]);

let offered = false;

/** Whether this is the first visit; without storage no visit is, and who comes back from a run is none. */
export function firstVisit(): boolean {
  if (offered) return false;
  offered = true;
  try {
    return localStorage.getItem(KEY) === null;
  } catch {
    return false;
  }
}

/** Remembers that the tour was closed. */
export function tourSeen(): void {
  try {
    localStorage.setItem(KEY, "seen");
  } catch {
    // It is shown again next time.
  }
}

/** The card of each step of the editor; others keep the card that is shown. */
const CARD: Partial<Record<Step, number>> = { region: 0, actors: 1, run: 2 };

/** Three cards beside the map that follow the user; the page can be used while they are there. */
export function Tour({ step, onClose }: { step: Step; onClose: () => void }) {
  const [at, setAt] = useState(0);
  const before = useRef(step);
  // It begins with its first card, wherever one is, and follows from then on.
  useEffect(() => {
    if (step === before.current) return;
    before.current = step;
    setAt((old) => CARD[step] ?? old);
  }, [step]);
  const [title, text] = nth(STEPS(), at);
  const last = at === STEPS().length - 1;
  return (
    <div
      className="tour"
      role="dialog"
      aria-label={t`Short tour`}
      onKeyDown={(event) => {
        if (event.key === "Escape" && !closesList(event)) {
          onClose();
          event.stopPropagation();
        }
      }}
    >
      <Group justify="space-between" wrap="nowrap">
        <Text fw={700}>{title}</Text>
        <CloseButton aria-label={t`Close the tour`} onClick={onClose} />
      </Group>
      <Text size="sm" aria-live="polite">
        {text}
      </Text>
      <Group justify="space-between" mt="sm">
        <Text size="xs" c="dimmed">
          <Trans>
            {at + 1} of {STEPS().length}
          </Trans>
        </Text>
        <Group gap={6}>
          {at > 0 && (
            <Button size="compact-sm" variant="default" onClick={() => setAt(at - 1)}>
              <Trans>Back</Trans>
            </Button>
          )}
          <Button size="compact-sm" onClick={() => (last ? onClose() : setAt(at + 1))}>
            {last ? t`Done` : t`Next`}
          </Button>
        </Group>
      </Group>
    </div>
  );
}
