import { Alert, Button } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import type { EditorStore } from "./store";

/** Why the last change was not made; one that still makes sense can be asked for again. */
export function RefusalAlert({ store }: { store: EditorStore }) {
  const { refusal, clearRefusal } = store();
  if (!refusal) return null;
  return (
    <div className="notices refusal">
      <Alert
        color="red.9"
        variant="filled"
        title={refusal.title}
        withCloseButton
        closeButtonLabel={t`Close this message`}
        onClose={clearRefusal}
        role="alert"
      >
        {refusal.message}
        {refusal.again && (
          <div>
            <Button
              mt="xs"
              size="compact-sm"
              variant="white"
              color="dark"
              onClick={() => void refusal.again?.()}
            >
              <Trans>Apply my change again</Trans>
            </Button>
          </div>
        )}
      </Alert>
    </div>
  );
}
