import { i18n } from "@lingui/core";
import { Button, Table, Text, UnstyledButton } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useMemo, useState } from "react";

import type { SweepCase, SweepCases } from "../api/sweeps";
import { shortNumber } from "../editor/parameters";
import { type Column, sorted, VERDICT_WORD, verdictOf } from "./plan";
import { served } from "../language/served";

/** Rows at first; a browser is slow with thousands. */
const MOST = 200;

/** All cases, by any column; a case opens by its name. */
export function CaseTable({ table, onOpen }: { table: SweepCases; onOpen: (name: string) => void }) {
  const [column, setColumn] = useState<Column>({ kind: "case" });
  const [down, setDown] = useState(false);
  const [whole, setWhole] = useState(false);
  const rows = useMemo(() => sorted(table.cases, column, down), [table, column, down]);
  const measured = useMemo(() => shownColumns(table), [table]);
  const head = (label: string, mine: Column) => {
    const on = JSON.stringify(mine) === JSON.stringify(column);
    return (
      <Table.Th key={label} aria-sort={on ? (down ? "descending" : "ascending") : "none"}>
        <UnstyledButton
          fz="inherit"
          fw="inherit"
          onClick={() => {
            setColumn(mine);
            setDown(on ? !down : false);
          }}
        >
          {label} <span aria-hidden="true">{on ? (down ? "▼" : "▲") : ""}</span>
        </UnstyledButton>
      </Table.Th>
    );
  };
  const shown = whole ? rows : rows.slice(0, MOST);
  return (
    <>
      <Table.ScrollContainer minWidth={640}>
        <Table verticalSpacing={4} fz={14} aria-label={t`Cases of the sweep`} className="case-table">
          <Table.Thead>
            <Table.Tr>
              {head(t`Case`, { kind: "case" })}
              {head(t`Outcome`, { kind: "safe" })}
              {table.parameters.map(({ name, unit }, at) =>
                head(withUnit(name, unit), { kind: "value", at }),
              )}
              {measured.map((at) => {
                const { name = "", unit = "" } = table.columns[at] ?? {};
                return head(withUnit(name, unit), { kind: "measure", at });
              })}
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {shown.map((one) => (
              <Row key={one.case} one={one} table={table} measured={measured} onOpen={onOpen} />
            ))}
          </Table.Tbody>
        </Table>
      </Table.ScrollContainer>
      {shown.length < rows.length && (
        <Button variant="default" mt="sm" onClick={() => setWhole(true)}>
          <Trans>Show all {rows.length.toLocaleString(i18n.locale)}</Trans>
        </Button>
      )}
    </>
  );
}

function Row({
  one,
  table,
  measured,
  onOpen,
}: {
  one: SweepCase;
  table: SweepCases;
  measured: readonly number[];
  onOpen: (name: string) => void;
}) {
  const verdict = verdictOf(one, table.columns);
  return (
    <Table.Tr>
      <Table.Td>
        <Button
          size="compact-sm"
          variant="subtle"
          disabled={one.status === "refused"}
          aria-label={t`Open ${one.case} in the editor`}
          onClick={() => onOpen(one.case)}
        >
          {one.case}
        </Button>
      </Table.Td>
      <Table.Td>
        <span className="verdict" data-verdict={verdict}>
          {verdict === "other" ? one.status : VERDICT_WORD()[verdict]}
        </span>
        {one.detail && (
          <Text size="xs" c="dimmed">
            {served(one.detail)}
          </Text>
        )}
      </Table.Td>
      {one.values.map((value, n) => (
        <Table.Td key={n}>{shortNumber(value)}</Table.Td>
      ))}
      {measured.map((at) => (
        <Table.Td key={at}>{measureWord(table.columns[at]?.name, one.measures[at] ?? null)}</Table.Td>
      ))}
    </Table.Tr>
  );
}

/** Measures that some case has. */
const shownColumns = ({ columns, cases }: SweepCases): number[] =>
  columns.flatMap((_, at) => (cases.some(({ measures }) => measures[at] !== null) ? [at] : []));

const withUnit = (name: string, unit: string): string => (unit ? `${name}, ${unit}` : name);

const measureWord = (name: string | undefined, value: number | null): string => {
  if (value === null) return "";
  if (name === "collision") return value ? t`yes` : t`no`;
  return String(Number(value.toPrecision(4)));
};
