import { Alert, Button, FileButton, Group, Loader, Text } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type Import, RECORDED } from "./useImport";

export const XOSC_FILES = ".xosc,.xodr";
/** Recordings, and the maps that come with them. */
export const RECORDED_FILES = ".csv,.parquet,.osi,.mcap,.pkl,.xml,.xodr,.osm,.json";

/** Scrolls to what has just been shown. */
const intoSight = (shown: HTMLElement | null): void => shown?.scrollIntoView({ block: "nearest" });

/** An import of OpenSCENARIO or a recording that is running, or why it was refused. */
export function ImportWork({ work: { state, begin, cancel, close } }: { work: Import }) {
  if (!state) return null;
  const names = state.files.map(({ name }) => name).join(", ");
  if (state.refusal === null)
    return (
      <Alert key="going" ref={intoSight} color="blue" my="md" role="status" title={t`Importing ${names}`}>
        <Group gap="sm">
          <Loader size={16} aria-hidden="true" />
          <Text size="sm">{state.step} …</Text>
          <Button size="compact-sm" variant="default" disabled={state.job === null} onClick={cancel}>
            <Trans>Cancel</Trans>
          </Button>
        </Group>
      </Alert>
    );
  return (
    <Alert
      key="refused"
      ref={intoSight}
      color="red"
      my="md"
      title={t`${names} could not be imported`}
      withCloseButton
      closeButtonLabel={t`Close this message`}
      onClose={close}
      style={{ overflowWrap: "anywhere" }}
    >
      <Text size="sm" mb="sm">
        {state.refusal}
      </Text>
      <FileButton
        multiple
        accept={state.of === RECORDED ? RECORDED_FILES : XOSC_FILES}
        onChange={(more) => begin(together(state.files, more), state.of)}
      >
        {(props) => (
          <Button size="compact-sm" variant="default" {...props}>
            {state.of === RECORDED
              ? t`Add the files that belong to it and try again`
              : t`Add its map or catalogs and try again`}
          </Button>
        )}
      </FileButton>
    </Alert>
  );
}

/** Files of both; a newer one takes the place of one of its name. */
function together(files: readonly File[], more: readonly File[]): File[] {
  const newer = new Set(more.map(({ name }) => name));
  return [...files.filter(({ name }) => !newer.has(name)), ...more];
}
