import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { Button, Tooltip } from "@mantine/core";

import { IconMinus, IconViews } from "../ui/icons";

/** What a view is called among several, in words that tell it apart. */
export const viewName = (number: number, count: number): string => t`View ${number} of ${count}`;

/** Adds a view of the run, or closes the one that they lie on. */
export function ViewButtons({
  name,
  onAdd,
  onClose,
}: {
  /** What the view is called; null of one alone. */
  name: string | null;
  /** Null where there are as many as fit. */
  onAdd: (() => void) | null;
  onClose: () => void;
}) {
  return (
    <>
      {onAdd && (
        <Tooltip withinPortal={false} label={t`Add a view`}>
          <Button
            className="view-button"
            size="xs"
            variant="default"
            aria-label={t`Add a view`}
            leftSection={<IconViews size={14} />}
            onClick={onAdd}
          >
            <Trans>Add a view</Trans>
          </Button>
        </Tooltip>
      )}
      {name !== null && (
        <Tooltip withinPortal={false} label={t`Close this view`}>
          <Button
            className="view-button"
            size="xs"
            variant="default"
            aria-label={t`Close this view: ${name}`}
            leftSection={<IconMinus size={14} />}
            onClick={onClose}
          >
            <Trans>Close this view</Trans>
          </Button>
        </Tooltip>
      )}
    </>
  );
}
