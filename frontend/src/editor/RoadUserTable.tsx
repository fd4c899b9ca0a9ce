import { ActionIcon, Button, TextInput } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { useLingui } from "@lingui/react";
import { Trans } from "@lingui/react/macro";
import { type KeyboardEvent, memo, type ReactNode, useEffect, useMemo, useRef, useState } from "react";

import { clock, hasClock } from "../language/moments";
import { speedText } from "../language/units";
import { localized } from "../language/localized";
import { type Actor, CATEGORIES, type Flow } from "../api/types";
import type { Graph } from "../map/graph";
import { CategoryGlyph, IconFlow, IconTrash } from "../ui/icons";
import { inSentence, CATEGORY_WORD, flowWord, modelWord, styleWord } from "../ui/words";
import { placeWord } from "./placeWords";
import { isFlow } from "./placing";
import { rowsInSight } from "./windowed";

const ROW = 34;
/** From so many on it is worth searching. */
const MANY = 8;
const COLUMNS = localized(() => [
  t`Name`,
  t`Kind`,
  t`Model`,
  t`Start`,
  t`Goal`,
  t`Speed`,
  t`Departs`,
  t`Driving style`,
  t`Ego`,
]);

/** All road users and flows of the scenario, only the rows in sight drawn; choosing a row is choosing on the map. */
export const RoadUserTable = memo(function RoadUserTable({
  ones,
  graph,
  selection,
  place,
  head,
  open,
  onOpen,
  onSelect,
  onSelectAll,
  onRemove,
}: {
  ones: readonly (Actor | Flow)[];
  graph: Graph;
  selection: readonly string[];
  /** Where in the page one is; the search ends when that changes. */
  place: string;
  /** The first thing in its bar. */
  head: ReactNode;
  open: boolean;
  onOpen: (open: boolean) => void;
  onSelect: (id: string, more: boolean) => void;
  onSelectAll: (ids: string[]) => void;
  onRemove: (ids: readonly string[]) => void;
}) {
  // Drawn anew with another language.
  useLingui();
  const [filter, setFilter] = useState("");
  const [scroll, setScroll] = useState({ top: 0, height: 300 });
  const searching = ones.length > MANY;
  // Rows that a search hides which is not seen any more would seem lost.
  useEffect(() => setFilter(""), [place, searching]);
  const box = useRef<HTMLDivElement>(null);
  const chosen = useMemo(() => new Set(selection), [selection]);
  const rows = useMemo(() => {
    const words = filter.toLowerCase().trim();
    return words
      ? ones.filter((one) =>
          `${one.id} ${kindWord(one)} ${isFlow(one) ? "" : (one.model ?? "")} ${placeWord(graph, one.spawn)}`
            .toLowerCase()
            .includes(words),
        )
      : ones;
  }, [ones, filter, graph]);
  const [first, end] = rowsInSight(rows.length, ROW, scroll.top, scroll.height);

  const latest = useRef({ onSelect, onRemove });
  useEffect(() => {
    latest.current = { onSelect, onRemove };
  });
  const actions = useMemo<RowActions>(
    () => ({
      select: (id, more) => latest.current.onSelect(id, more),
      remove: (id) => latest.current.onRemove([id]),
    }),
    [],
  );
  const one = selection.length === 1 ? selection[0] : null;
  useEffect(() => {
    const n = one === null ? -1 : rows.findIndex((row) => row.id === one);
    const element = box.current;
    if (n < 0 || !element) return;
    // Below the heading, which stays.
    if (n * ROW < element.scrollTop) element.scrollTop = n * ROW;
    else if ((n + 2) * ROW > element.scrollTop + element.clientHeight)
      element.scrollTop = (n + 2) * ROW - element.clientHeight;
  }, [one, rows]);

  const onKeyDown = (event: KeyboardEvent): void => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    const row = event.target instanceof Element ? event.target.closest<HTMLElement>("[data-row]") : null;
    if (!step || !row) return;
    event.preventDefault();
    const next = row.parentElement?.querySelector<HTMLElement>(
      `[data-row="${Number(row.dataset.row) + step}"] .row-button`,
    );
    next?.focus();
  };
  return (
    <div className="table-dock" data-open={open}>
      <div className="table-bar">
        {head}
        <span role="status">
          {plural(ones.length, { one: "# entry", other: "# entries" })}
          {selection.length > 0 && t`, ${selection.length} selected`}
        </span>
        <Button
          size="compact-xs"
          variant="default"
          disabled={rows.length === 0}
          onClick={() => onSelectAll(rows.map((row) => row.id))}
        >
          <Trans>Select all</Trans>
        </Button>
        {searching && open && (
          <TextInput
            size="xs"
            placeholder={t`Search`}
            aria-label={t`Search the table of road users`}
            value={filter}
            onChange={(event) => setFilter(event.currentTarget.value)}
          />
        )}
        <Button
          size="compact-xs"
          variant="subtle"
          ml="auto"
          aria-expanded={open}
          onClick={() => onOpen(!open)}
        >
          {open ? t`Hide the table` : t`Show the table`}
        </Button>
      </div>
      <div
        className="table"
        hidden={!open}
        role="region"
        aria-label={t`Table of road users`}
        tabIndex={0}
        ref={box}
        onKeyDown={onKeyDown}
        onScroll={({ currentTarget: { scrollTop, clientHeight } }) =>
          setScroll({ top: scrollTop, height: clientHeight })
        }
      >
        <table aria-rowcount={rows.length + 1}>
          <thead>
            <tr aria-rowindex={1}>
              {COLUMNS().map((word) => (
                <th scope="col" key={word}>
                  {word}
                </th>
              ))}
              <td />
            </tr>
          </thead>
          <tbody>
            {first > 0 && <tr aria-hidden="true" style={{ height: first * ROW }} />}
            {rows.slice(first, end).map((row, n) => (
              <Row
                key={row.id}
                one={row}
                n={first + n}
                graph={graph}
                chosen={chosen.has(row.id)}
                actions={actions}
              />
            ))}
            {end < rows.length && <tr aria-hidden="true" style={{ height: (rows.length - end) * ROW }} />}
          </tbody>
        </table>
        {rows.length === 0 && (
          <p className="table-empty">
            {ones.length === 0 ? t`No road users yet.` : t`No road user matches “${filter}”.`}
          </p>
        )}
      </div>
    </div>
  );
});

interface RowActions {
  select: (id: string, more: boolean) => void;
  remove: (id: string) => void;
}

/** One row; only its number changes when a row before it comes or goes, and its cells stay. */
const Row = memo(function Row({
  one,
  n,
  graph,
  chosen,
  actions,
}: {
  one: Actor | Flow;
  n: number;
  graph: Graph;
  chosen: boolean;
  actions: RowActions;
}) {
  return (
    <tr
      data-row={n}
      aria-rowindex={n + 2}
      data-selected={chosen}
      style={{ height: ROW }}
      onClick={(event) => actions.select(one.id, event.shiftKey || event.ctrlKey)}
    >
      <Cells one={one} graph={graph} chosen={chosen} actions={actions} />
    </tr>
  );
});

const Cells = memo(function Cells({
  one,
  graph,
  chosen,
  actions,
}: {
  one: Actor | Flow;
  graph: Graph;
  chosen: boolean;
  actions: RowActions;
}) {
  // Drawn anew with another language.
  useLingui();
  return (
    <>
      <td>
        <button
          type="button"
          className="row-button"
          aria-pressed={chosen}
          onClick={(event) => {
            event.stopPropagation();
            actions.select(one.id, event.shiftKey || event.ctrlKey);
          }}
        >
          {one.id}
        </button>
      </td>
      <td>
        <span className="kind">
          {isFlow(one) ? <IconFlow size={20} /> : <CategoryGlyph category={one.category} size={22} />}
          {kindWord(one)}
        </span>
      </td>
      <td>{isFlow(one) ? "–" : one.model ? modelWord(one.model) : t`any`}</td>
      <td>
        <span title={one.spawn}>{placeWord(graph, one.spawn)}</span>
      </td>
      <td>{one.goal ? <span title={one.goal}>{placeWord(graph, one.goal)}</span> : t`random`}</td>
      <td>{speedWord(one)}</td>
      <td>{departWords(one)}</td>
      <td>
        {isFlow(one)
          ? t`${Math.round(one.per_hour)} per hour`
          : one.category === "pedestrian"
            ? "–"
            : styleWord(one.style)}
      </td>
      <td>{!isFlow(one) && one.ego ? t`yes` : ""}</td>
      <td>
        <ActionIcon
          size="sm"
          variant="subtle"
          color="gray"
          aria-label={t`Remove ${one.id}`}
          onClick={(event) => {
            event.stopPropagation();
            actions.remove(one.id);
          }}
        >
          <IconTrash size={15} />
        </ActionIcon>
      </td>
    </>
  );
});

const walks = (one: Actor | Flow): boolean =>
  isFlow(one) ? "pedestrian" in one.mix : one.category === "pedestrian";

function kindWord(one: Actor | Flow): string {
  if (!isFlow(one)) return CATEGORY_WORD()[one.category];
  if (walks(one)) return flowWord(true);
  return t`Flow: ${CATEGORIES.filter((category) => one.mix[category])
    .map((category) => inSentence(CATEGORY_WORD()[category]))
    .join(", ")}`;
}

function speedWord(one: Actor | Flow): string {
  if (one.speed !== null) return speedText(one.speed);
  return walks(one) ? t`default` : t`speed limit`;
}

function departWords(one: Actor | Flow): string {
  if (isFlow(one))
    return hasClock() ? t`${clock(one.begin)} to ${clock(one.end)}` : t`${one.begin} to ${one.end} s`;
  return hasClock() ? clock(one.depart) : t`after ${one.depart} s`;
}
