import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import "./time.css";

import { Button, Tooltip } from "@mantine/core";
import { type ReactNode, useEffect, useMemo, useRef, useState } from "react";

import { rowsInSight } from "../editor/windowed";
import type { EditorNow } from "../editor/useEditing";
import { nth } from "../lists";
import { Axis, Lines } from "./Axis";
import { panned, type Sight, zoomed } from "./sight";
import { type Block, blocksOf, keyOf } from "./blocks";
import { BlockRow } from "./BlockRow";
import type { Plan } from "./usePlanned";
import { useRetiming } from "./useRetiming";
import { useWidth } from "./useWidth";
import { ZoomButtons } from "./ZoomButtons";

const ROW = 26;
/** Seconds that are in sight at least to begin with. */
const USUAL = 30;
const STEP_OF = { rule: "rules", measure: "measures" } as const;

/** When everything in the scenario is: blocks that can be dragged, and a moment of which the plan is shown. */
export function TimeDock({
  now,
  plan,
  moment,
  open,
  head,
  onMoment,
  onOpen,
}: {
  now: EditorNow;
  plan: Plan;
  moment: number | null;
  open: boolean;
  head: ReactNode;
  onMoment: (moment: number | null) => void;
  onOpen: (open: boolean) => void;
}) {
  const { document, changes, selection } = now;
  const { planned } = plan;
  const longest = document.simulation.duration;
  const blocks = useMemo(
    () => blocksOf(document, planned?.durations ?? new Map<string, number>()),
    [document, planned],
  );
  const retiming = useRetiming(document, changes, longest);
  const [box, width] = useWidth();
  const [chosen, setChosen] = useState<{ begin: number; seconds: number } | null>(null);
  const fit = useMemo(() => fitted(blocks, longest), [blocks, longest]);
  const sight: Sight = { ...clipped(chosen ?? fit, longest), width };
  const see = ({ begin, seconds }: Sight): void => setChosen({ begin, seconds });
  const zoom = (factor: number): void =>
    see(zoomed(sight, factor, moment ?? sight.begin + sight.seconds / 2, longest));
  const rows = useRef<HTMLDivElement>(null);
  const [scroll, setScroll] = useState({ top: 0, height: 300 });
  const one = selection.length === 1 ? selection[0] : null;
  // Who is chosen on the map comes into sight.
  useEffect(() => {
    const n =
      one === null
        ? -1
        : blocks.findIndex(({ id, kind }) => id === one && (kind === "actor" || kind === "flow"));
    const element = rows.current;
    if (n < 0 || !element) return;
    if (n * ROW < element.scrollTop) element.scrollTop = n * ROW;
    // Below the scale, which stays.
    else if ((n + 2) * ROW > element.scrollTop + element.clientHeight)
      element.scrollTop = (n + 2) * ROW - element.clientHeight;
    // Only when another is chosen: a row that is dragged must not run away.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [one]);
  const choose = ({ kind, id }: Block): void => {
    if (kind === "rule" || kind === "measure") now.openStep(STEP_OF[kind]);
    else {
      now.openActors();
      now.select([id]);
    }
  };
  const [first, end] = rowsInSight(blocks.length, ROW, scroll.top, scroll.height);
  return (
    <div className="table-dock" data-open={open}>
      <div className="table-bar">
        {head}
        <span role="status" className="time-status">
          {statusOf(plan, moment)}
        </span>
        {open && <ZoomButtons onZoom={zoom} onWhole={() => setChosen({ begin: 0, seconds: longest })} />}
        {moment !== null && (
          <Button size="compact-xs" variant="default" onClick={() => onMoment(null)}>
            <Trans>Back to the starts</Trans>
          </Button>
        )}
        <Button size="compact-xs" variant="subtle" aria-expanded={open} onClick={() => onOpen(!open)}>
          {open ? t`Hide the time bar` : t`Show the time bar`}
        </Button>
      </div>
      <div
        className="time"
        hidden={!open}
        role="region"
        aria-label={t`Time bar`}
        onWheel={({ deltaX, deltaY, ctrlKey, shiftKey }) => {
          if (ctrlKey) zoom(Math.exp(-deltaY * 0.002));
          else if (deltaX || shiftKey)
            see(panned(sight, ((deltaX || deltaY) / width) * sight.seconds, longest));
        }}
      >
        <div
          className="time-rows"
          ref={rows}
          tabIndex={0}
          role="group"
          aria-label={t`Departures, flows, measures and rules`}
          onScroll={({ currentTarget: { scrollTop, clientHeight } }) =>
            setScroll({ top: scrollTop, height: clientHeight })
          }
        >
          <div className="time-inner">
            <Lines sight={sight} moment={moment} />
            <div className="time-head">
              <span className="time-label">
                {plural(blocks.length, { one: "# entry", other: "# entries" })}
              </span>
              <div className="time-track" ref={box}>
                <Axis
                  sight={sight}
                  longest={longest}
                  moment={moment ?? 0}
                  label={t`Planned moment`}
                  says={(time) =>
                    planned
                      ? t`${plural(planned.there(time).length, { one: "# road user", other: "# road users" })} on the road`
                      : ""
                  }
                  onMoment={onMoment}
                />
              </div>
            </div>
            {blocks.length === 0 && (
              <p className="table-empty">
                <Trans>Nothing has a time yet: place a road user, or add a flow, a measure or a rule.</Trans>
              </p>
            )}
            <div style={{ height: first * ROW }} />
            {Array.from({ length: end - first }, (_, k) => nth(blocks, first + k)).map((block) => (
              <div
                key={keyOf(block)}
                className="time-row"
                data-selected={
                  selection.includes(block.id) && (block.kind === "actor" || block.kind === "flow")
                }
                style={{ height: ROW }}
              >
                <Tooltip label={`${block.word} ${block.id}`} openDelay={500}>
                  <button type="button" className="time-label" onClick={() => choose(block)}>
                    <b>{block.id}</b> <span>{block.word}</span>
                  </button>
                </Tooltip>
                <BlockRow
                  block={block}
                  sight={sight}
                  longest={longest}
                  retiming={retiming}
                  onChoose={() => choose(block)}
                />
              </div>
            ))}
            <div style={{ height: (blocks.length - end) * ROW }} />
          </div>
        </div>
      </div>
    </div>
  );
}

/** From the start to a little after the last that has an end; flows and measures without an end do not count. */
function fitted(blocks: readonly Block[], longest: number): { begin: number; seconds: number } {
  const last = Math.max(
    USUAL,
    ...blocks.map(({ begin, until, ends }) => (ends && until >= longest ? begin : until)),
  );
  return { begin: 0, seconds: Math.min(longest, Math.ceil((last * 1.25) / 10) * 10) };
}

function clipped(
  { begin, seconds }: { begin: number; seconds: number },
  longest: number,
): { begin: number; seconds: number } {
  const shown = Math.min(seconds, longest);
  return { begin: Math.max(0, Math.min(begin, longest - shown)), seconds: shown };
}

function statusOf({ planned, busy, error }: Plan, moment: number | null): string {
  if (error) return t`No plan: ${error}`;
  if (!planned) return t`Planning …`;
  const { leftOut, notPlanned } = planned;
  const said = [
    moment === null
      ? t`Drag the blocks; a moment chosen on the scale shows the plan on the map.`
      : t`Planned, not simulated: ${plural(planned.there(moment).length, { one: "# road user", other: "# road users" })} on the road.`,
  ];
  if (busy) said.unshift(t`Planning …`);
  if (leftOut.length > 0) {
    const names = `${leftOut.slice(0, 3).join(", ")}${leftOut.length > 3 ? ", …" : ""}`;
    said.push(t`Not planned: ${names}.`);
  }
  if (notPlanned > 0)
    said.push(
      t`The last ${plural(notPlanned, { one: "# road user", other: "# road users" })} are not planned.`,
    );
  return said.join(" ");
}
