import { i18n } from "@lingui/core";
import { Alert, Button, List, Loader, Table, Text, Title } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import { useCallback, useEffect, useState } from "react";

import { fixed } from "../language/numbers";
import { type FitRow, runs } from "../api/runs";
import type { PlaceNames } from "../map/placeNames";
import { useLoaded } from "../ui/useLoaded";
import { span } from "../language/moments";
import { worstFirst } from "./fit";
import { Scatter } from "./Scatter";
import { served } from "../language/served";

/** Rows of the list; all of them are in the tables that can be downloaded. */
const LISTED = 200;

/** How well a run meets the counts of its scenario. */
export function CountsFit({
  run,
  places,
  onFit,
  onShow,
}: {
  run: string;
  places: PlaceNames;
  /** Called once they are known, and with null when they are out of sight. */
  onFit: (rows: readonly FitRow[] | null) => void;
  onShow: (x: number, y: number) => void;
}) {
  const { value, error } = useLoaded(useCallback(() => runs.fit(run), [run]));
  const [all, setAll] = useState(false);
  useEffect(() => {
    onFit(value?.rows ?? null);
    return () => onFit(null);
  }, [value, onFit]);
  if (error)
    return (
      <Alert color="gray" title={t`The counts cannot be compared`}>
        {error}
      </Alert>
    );
  if (!value) return <Loader aria-label={t`Counting`} />;
  const { rows, met, hours, hours_met, rmse, contradictions } = value;
  const shown = worstFirst(all ? rows : rows.filter((row) => !row.met));
  return (
    <>
      <Title order={2} size="h5">
        <Trans>
          {met.toLocaleString(i18n.locale)} of <Plural value={rows.length} one="# count" other="# counts" />{" "}
          met ({Math.round((100 * met) / rows.length)} %)
        </Trans>
      </Title>
      <Text size="sm" mt={4} mb="sm">
        <Trans>
          A count is met if its GEH, the usual measure of how far two numbers of vehicles are apart, is 5 or
          less.
        </Trans>
        {hours > 0 && ` ${t`Of the whole hours that the counts make up, ${hours_met} of ${hours} are met.`}`}
        {rmse !== null && ` ${t`The mean error is ${fixed(rmse, 1)} vehicles (root mean square).`}`}
      </Text>
      <Scatter rows={rows} />
      {contradictions.length > 0 && (
        <Alert color="gray" title={t`Counts that contradict each other`} mb="md">
          <List size="sm">
            {contradictions.slice(0, 20).map((text) => (
              <List.Item key={text}>{served(text)}</List.Item>
            ))}
          </List>
        </Alert>
      )}
      <Title order={2} size="h5">
        {all ? t`All counts` : t`Not met`}
      </Title>
      {rows.length > met && (
        <Text size="xs" c="dimmed">
          <Trans>Choose one to see its count station.</Trans>
        </Text>
      )}
      {shown.length === 0 && (
        <Text size="sm">
          <Trans>Every count is met.</Trans>
        </Text>
      )}
      {shown.length > 0 && (
        <Table
          mt="xs"
          verticalSpacing={4}
          horizontalSpacing={5}
          fz={13}
          aria-label={all ? t`All counts` : t`Counts that are not met`}
        >
          <Table.Thead>
            <Table.Tr>
              <Table.Th>
                <Trans>Count station and time</Trans>
              </Table.Th>
              <Table.Th ta="right">
                <Trans>Counted</Trans>
              </Table.Th>
              <Table.Th ta="right">
                <Trans>Simulated</Trans>
              </Table.Th>
              <Table.Th ta="right">GEH</Table.Th>
            </Table.Tr>
          </Table.Thead>
          {shown.slice(0, LISTED).map((row) => (
            <Row key={`${row.counts} ${row.place} ${row.begin}`} row={row} places={places} onShow={onShow} />
          ))}
        </Table>
      )}
      {shown.length > LISTED && (
        <Text size="sm" c="dimmed" mt="xs">
          <Trans>and {(shown.length - LISTED).toLocaleString(i18n.locale)} more</Trans>
        </Text>
      )}
      <Button mt="sm" variant="default" size="compact-sm" onClick={() => setAll(!all)}>
        {all ? t`Only those that are not met` : t`Show all counts`}
      </Button>
    </>
  );
}

function Row({
  row,
  places,
  onShow,
}: {
  row: FitRow;
  places: PlaceNames;
  onShow: (x: number, y: number) => void;
}) {
  const { x, y, begin, end, counted, modelled, geh, why } = row;
  const name = places.place(row.place).replaceAll(">", " > ");
  return (
    <Table.Tbody className="fit-row">
      <Table.Tr>
        <Table.Th scope="row" fw={400}>
          {x !== null && y !== null ? (
            <button type="button" className="row-button" onClick={() => onShow(x, y)}>
              {name}
            </button>
          ) : (
            name
          )}
          <div className="fit-time">{span(begin, end)}</div>
        </Table.Th>
        <Table.Td ta="right">{counted.toLocaleString(i18n.locale)}</Table.Td>
        <Table.Td ta="right">{modelled.toLocaleString(i18n.locale)}</Table.Td>
        <Table.Td ta="right">{fixed(geh, 1)}</Table.Td>
      </Table.Tr>
      {why && (
        <Table.Tr>
          <Table.Td colSpan={4} c="dimmed" pt={0}>
            {served(why)}
          </Table.Td>
        </Table.Tr>
      )}
    </Table.Tbody>
  );
}
