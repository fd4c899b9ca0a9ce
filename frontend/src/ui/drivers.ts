import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";

const SHIPPED = localized((): Record<string, string> => ({
  idm: t`Intelligent driver model`,
  imitation: t`Imitation of SUMO’s drivers`,
  "max-pressure": t`Lights by max-pressure`,
  "signal-agent": t`Lights by a learned agent`,
}));

/** What a behaviour model is called. */
export const driverWords = (name: string): string => SHIPPED()[name] ?? t`Behaviour model ${name}`;
