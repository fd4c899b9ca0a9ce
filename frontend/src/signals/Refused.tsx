import { Text } from "@mantine/core";

import type { Attempt } from "./useAttempt";

/** Why what a field asked for was refused, below the field. */
export function Refused({ by: { refused } }: { by: Attempt }) {
  return (
    <Text size="sm" className="signal-refused" role="alert" hidden={refused === null}>
      {refused}
    </Text>
  );
}
