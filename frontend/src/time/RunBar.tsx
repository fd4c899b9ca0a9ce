import { i18n } from "@lingui/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import "./time.css";

import { Button } from "@mantine/core";
import { type MouseEvent, type ReactNode, useEffect, useMemo, useState } from "react";

import { fixed } from "../language/numbers";
import type { Incident } from "../api/runs";
import type { Category } from "../api/types";
import { MARK_COLOR, SIGNAL_COLOR } from "../map/colors";
import { MARK_WORD, markKind, sentence } from "../run/incidents";
import type { Shown } from "../signals/heads";
import { clock } from "../language/moments";
import { Axis, Lines } from "./Axis";
import { ZoomButtons } from "./ZoomButtons";
import { panned, type Sight, toTime, toX, zoomed } from "./sight";
import { type Band, bandsOf, type History, shownWords } from "./bands";
import { linePath, pointAt, SEEN, SERIOUS } from "./collision";
import { firingsOf, GLYPH, isRule, nearestIncident, neighbour, thinnedMarks } from "./fired";
import type { EgoTtc } from "./useNearest";
import { planAt, type PlanSpan } from "./plans";
import { useWidth } from "./useWidth";

/** Pixels around a mark that are it. */
const REACH = 9;
/** Height of the curve of TTC and of the bands of a light, pixels. */
const CURVE = 36;
const BANDS = 34;
/** Seconds for which an event is shown. */
const RECENT = 3;
/** Below this width of the window the bar is closed to begin with. */
const NARROW = 761;
/** Share of what is in sight that lies before the moment that it follows. */
const LEAD = 0.1;

/** What happened when in a run: rules, incidents, what a light showed, and the ego's time to collision. */
export function RunBar({
  end,
  reached,
  time,
  incidents,
  categories,
  junction,
  history,
  plans,
  ttc,
  spacing,
  first,
  onSeek,
  onShow,
}: {
  /** Of the run, also while it is not there yet; seconds. */
  end: number;
  /** How far the run has come, or the recording goes. */
  reached: number;
  time: number;
  incidents: readonly Incident[];
  categories: ReadonlyMap<string, Category>;
  /** Whose light is shown. */
  junction: string | null;
  history: History | null;
  /** Plans of the day of that light; fewer than two are not worth a row. */
  plans: readonly PlanSpan[];
  ttc: EgoTtc;
  /** Seconds between two moments of the recording. */
  spacing: number;
  /** Seconds that are in sight to begin with; null is all. */
  first: number | null;
  /** Jumps to an instant; nothing in a live run. */
  onSeek: ((time: number) => void) | null;
  onShow: (incident: Incident) => void;
}) {
  const [open, setOpen] = useState(() => innerWidth >= NARROW);
  const [box, width] = useWidth();
  const seconds = Math.max(end, 1);
  const [chosen, setChosen] = useState<{ begin: number; seconds: number } | null>(null);
  const sight = useMemo<Sight>(() => ({ begin: 0, seconds, ...chosen, width }), [seconds, chosen, width]);
  const apart = (3 * sight.seconds) / width;
  const see = ({ begin, seconds: shown }: Sight): void =>
    setChosen(shown < seconds ? { begin, seconds: shown } : null);
  const zoom = (factor: number, around = time): void => see(zoomed(sight, factor, around, seconds));
  // What is shown stays in sight as it moves on; it may be left by hand.
  useEffect(() => {
    setChosen((old) => {
      if (!old || (time >= old.begin && time <= old.begin + old.seconds)) return old;
      const begin = Math.min(time - LEAD * old.seconds, seconds - old.seconds);
      return { ...old, begin: Math.max(0, begin) };
    });
  }, [time, seconds]);
  useEffect(() => {
    if (first !== null) setChosen((old) => old ?? { begin: 0, seconds: first });
  }, [first]);
  const rules = useMemo(() => incidents.filter(isRule), [incidents]);
  const others = useMemo(() => incidents.filter((one) => !isRule(one)), [incidents]);
  const firings = useMemo(() => firingsOf(rules), [rules]);
  const known = history?.times.length ?? 0;
  // The same list grows in a live run.
  const bands = useMemo(
    () => (history ? bandsOf(history, reached) : []),
    // eslint-disable-next-line react-hooks/exhaustive-deps
    [history, known, reached],
  );
  const gap = Math.max(1, 1.5 * spacing);
  const now = pointAt(ttc.points, time, gap);
  const recent = incidents.findLast((one) => one.time <= time + 0.05 && time - one.time < RECENT);
  const kinds = new Set(incidents.map(markKind));
  const step = (by: 1 | -1): void => {
    const one = neighbour(incidents, time, by);
    if (!one) return;
    onSeek?.(one.time);
    onShow(one);
  };
  const choose = (event: MouseEvent<HTMLElement>, among: readonly Incident[]): void => {
    const left = event.currentTarget.querySelector(".time-track")?.getBoundingClientRect().left ?? 0;
    const at = toTime(sight, event.clientX - left);
    if (event.clientX < left) return;
    const one = nearestIncident(among, at, (REACH * sight.seconds) / width);
    onSeek?.(one ? one.time : Math.min(reached, Math.max(0, at)));
    if (one) onShow(one);
  };
  return (
    <section className="run-time" aria-label={t`Time bar`} data-live={onSeek === null}>
      <div className="table-bar">
        {onSeek && (
          <span role="group" aria-label={t`Events`} className="time-buttons">
            <Button
              size="compact-xs"
              variant="default"
              disabled={!neighbour(incidents, time, -1)}
              onClick={() => step(-1)}
            >
              <Trans>Event before</Trans>
            </Button>
            <Button
              size="compact-xs"
              variant="default"
              disabled={!neighbour(incidents, time, 1)}
              onClick={() => step(1)}
            >
              <Trans>Next event</Trans>
            </Button>
          </span>
        )}
        <span role="status" className="time-status">
          {recent ? `${clock(recent.time)} ${sentence(recent, categories)}` : ""}
        </span>
        <Legend kinds={kinds} signals={bands.length > 0} />
        {open && <ZoomButtons onZoom={zoom} onWhole={() => setChosen(null)} />}
        <Button size="compact-xs" variant="subtle" aria-expanded={open} onClick={() => setOpen(!open)}>
          {open ? t`Hide the time bar` : t`Show the time bar`}
        </Button>
      </div>
      <div
        className="time"
        hidden={!open}
        onWheel={({ deltaX, deltaY, ctrlKey, shiftKey }) => {
          if (ctrlKey) zoom(Math.exp(-deltaY * 0.002));
          else if (deltaX || shiftKey)
            see(panned(sight, ((deltaX || deltaY) / width) * sight.seconds, seconds));
        }}
      >
        <div className="time-inner">
          <Lines sight={sight} moment={time} />
          <div className="time-head">
            <span className="time-label">{clock(Math.min(time, end))}</span>
            <div className="time-track" ref={box}>
              <Axis sight={sight} longest={end} moment={time} label={null} onMoment={onSeek} />
            </div>
          </div>
          <Row
            name="rules"
            label={t`Rules`}
            note={rules.length === 0 ? t`none fired` : String(firings.length)}
            onChoose={(event) => choose(event, rules)}
          >
            {firings.map(({ begin: from, end: to }, n) => (
              <i
                key={n}
                className="time-span"
                style={{
                  left: toX(sight, from),
                  width: Math.max(0, toX(sight, to ?? reached) - toX(sight, from)),
                  background: MARK_COLOR.rule,
                }}
              />
            ))}
            <Marks marks={thinnedMarks(rules, apart)} sight={sight} categories={categories} />
          </Row>
          <Row
            name="incidents"
            label={t`Incidents`}
            note={others.length === 0 ? t`none` : others.length.toLocaleString(i18n.locale)}
            onChoose={(event) => choose(event, others)}
          >
            <Marks marks={thinnedMarks(others, apart)} sight={sight} categories={categories} />
          </Row>
          <Row
            name="light"
            label={junction === null ? t`Traffic light` : t`Light ${junction}`}
            note={junction === null ? t`none on the map` : shownWords(bands, time)}
            onChoose={(event) => choose(event, [])}
          >
            {bands.length > 0 && <Signals bands={bands} sight={sight} />}
          </Row>
          {new Set(plans.map(({ plan }) => plan)).size > 1 && (
            <Row
              name="plans"
              label={t`Plan of the day`}
              note={planAt(plans, time) ?? ""}
              onChoose={(event) => choose(event, [])}
            >
              {plans.map(({ plan, begin: from, end: to }) => (
                <i
                  key={from}
                  className="time-plan"
                  title={t`${plan}: ${clock(from)} to ${clock(to)}`}
                  style={{ left: toX(sight, from), width: Math.max(0, toX(sight, to) - toX(sight, from)) }}
                >
                  {plan}
                </i>
              ))}
            </Row>
          )}
          <Row
            name="ttc"
            label={t`Time to collision`}
            note={
              ttc.ego === null
                ? t`no ego`
                : now === null
                  ? t`${ttc.ego}: not on the road`
                  : now.ttc === null
                    ? t`${ttc.ego}: above ${SEEN} s`
                    : t`${ttc.ego}: ${fixed(now.ttc, 1)} s to ${now.other ?? ""}`
            }
            onChoose={(event) => choose(event, [])}
          >
            {ttc.ego !== null && (
              <svg className="time-curve" aria-hidden="true">
                <line
                  className="time-serious"
                  x1={0}
                  x2={width}
                  y1={levelOf(SERIOUS)}
                  y2={levelOf(SERIOUS)}
                />
                <text x={2} y={levelOf(SERIOUS) - 3}>
                  <Trans>{SERIOUS} s</Trans>
                </text>
                <text x={2} y={10}>
                  <Trans>{SEEN} s</Trans>
                </text>
                <path
                  className="time-ttc"
                  transform="translate(0 3)"
                  d={linePath(ttc.points, (at) => toX(sight, at), CURVE, gap)}
                />
              </svg>
            )}
          </Row>
        </div>
      </div>
    </section>
  );
}

/** Behind the states of lights, light or dark. */
const BACK = "#1b1f24";
const levelOf = (ttc: number): number => 3 + CURVE - (ttc / SEEN) * CURVE;

/** One row of the bar; a click in it chooses an instant, for which there is the slider by keyboard. */
function Row({
  name,
  label,
  note,
  onChoose,
  children,
}: {
  name: string;
  label: string;
  note: string;
  onChoose: (event: MouseEvent<HTMLElement>) => void;
  children: ReactNode;
}) {
  return (
    <div className="time-row" data-row={name} onClick={onChoose}>
      <span className="time-label" title={`${label}: ${note}`}>
        <b>{label}</b> <span>{note}</span>
      </span>
      <div className="time-track">{children}</div>
    </div>
  );
}

function Marks({
  marks,
  sight,
  categories,
}: {
  marks: readonly Incident[];
  sight: Sight;
  categories: ReadonlyMap<string, Category>;
}) {
  return marks.map((one, n) => (
    <i
      key={n}
      className="time-mark"
      aria-hidden="true"
      title={`${clock(one.time)} ${sentence(one, categories)}`}
      style={{ left: toX(sight, one.time), background: MARK_COLOR[markKind(one)] }}
    >
      {GLYPH[markKind(one)]}
    </i>
  ));
}

/** Share of a band's height that a line of it has: what may go is thick, red is thin. */
const THICK: Record<Shown, number> = { green: 0.9, permissive: 0.5, yellow: 0.7, red: 0.22, off: 0.1 };

function Signals({ bands, sight }: { bands: readonly Band[]; sight: Sight }) {
  const high = BANDS / bands.length;
  const spans = bands.flatMap((band) => band.spans);
  // Dark only where something was shown, not for the rest of a live run.
  const begin = toX(sight, Math.min(...spans.map((span) => span.begin)));
  const end = toX(sight, Math.max(...spans.map((span) => span.end)));
  return (
    <svg className="time-signal" width={sight.width} height={BANDS} aria-hidden="true">
      {spans.length > 0 && <rect x={begin} width={end - begin} height={BANDS} rx={3} fill={BACK} />}
      {(Object.keys(THICK) as Shown[]).map((shown) => (
        <path
          key={shown}
          stroke={SIGNAL_COLOR[shown]}
          strokeWidth={Math.max(1, high * THICK[shown])}
          d={bands
            .map(({ spans }, n) =>
              spans
                .filter((span) => span.shown === shown)
                .map(
                  ({ begin, end }) =>
                    `M${toX(sight, begin).toFixed(1)} ${((n + 0.5) * high).toFixed(1)}H${toX(sight, end).toFixed(1)}`,
                )
                .join(""),
            )
            .join("")}
        />
      ))}
    </svg>
  );
}

/** What the signs of the bar mean; only those that are in it. */
function Legend({ kinds, signals }: { kinds: ReadonlySet<ReturnType<typeof markKind>>; signals: boolean }) {
  return (
    <ul className="time-legend" aria-label={t`Signs of the time bar`}>
      {[...kinds].map((kind) => (
        <li key={kind}>
          <i className="time-mark" style={{ background: MARK_COLOR[kind] }} aria-hidden="true">
            {GLYPH[kind]}
          </i>
          {MARK_WORD()[kind]}
        </li>
      ))}
      {signals && (
        <li>
          <Trans>
            <svg width={34} height={14} aria-hidden="true" style={{ background: BACK, borderRadius: 3 }}>
              <path d="M2 7H11" stroke={SIGNAL_COLOR.green} strokeWidth={10} />
              <path d="M12 7H21" stroke={SIGNAL_COLOR.yellow} strokeWidth={7} />
              <path d="M22 7H32" stroke={SIGNAL_COLOR.red} strokeWidth={2.5} />
            </svg>
            Green, yellow, red
          </Trans>
        </li>
      )}
    </ul>
  );
}
