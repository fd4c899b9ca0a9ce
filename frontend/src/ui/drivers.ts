import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";

const SHIPPED = localized((): Record<string, string> => ({
  idm: t`Intelligent driver model`,
  imitation: t`Imitation of SUMO’s drivers`,
}));

/** What a behaviour model is called. */
export const driverWords = (name: string): string => SHIPPED()[name] ?? t`Behaviour model ${name}`;
