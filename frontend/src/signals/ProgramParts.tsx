import { Text } from "@mantine/core";
import { Trans } from "@lingui/react/macro";
import type { ReactNode } from "react";

import type { LightProgram } from "../api/signals";
import type { ApproachNames } from "../map/placeNames";
import { DayPlans } from "./DayPlans";
import { DetectorForms } from "./DetectorForms";
import type { SignalEditing } from "./editing";
import { GroupForms } from "./GroupForms";
import { IntergreenMatrix } from "./IntergreenMatrix";

/** All that a program is made of: groups, intergreens, detectors and plans of the day. */
export function ProgramParts({
  light,
  junction,
  names,
  editing,
}: {
  light: LightProgram;
  junction: string;
  names: ApproachNames;
  editing: SignalEditing;
}) {
  const own = light.origin === "scenario" && editing.timing ? editing.timing : null;
  const parts = { light, junction, editing };
  return (
    <>
      <Fold title={<Trans>Change signal groups and stages</Trans>}>
        {own ? <GroupForms {...parts} names={names} timing={own} /> : <Later />}
      </Fold>
      <Fold title={<Trans>Change intergreens</Trans>}>
        {own ? <IntergreenMatrix {...parts} timing={own} /> : <Later />}
      </Fold>
      <Fold title={<Trans>Change detectors</Trans>}>
        <DetectorForms {...parts} names={names} />
      </Fold>
      <Fold title={<Trans>Change the plans of the day</Trans>}>
        {own ? <DayPlans {...parts} timing={own} /> : <Later />}
      </Fold>
    </>
  );
}

function Fold({ title, children }: { title: ReactNode; children: ReactNode }) {
  return (
    <details>
      <summary>{title}</summary>
      {children}
    </details>
  );
}

function Later() {
  return (
    <Text size="sm" c="dimmed">
      <Trans>They can be changed once the program is the scenario’s own.</Trans>
    </Text>
  );
}
