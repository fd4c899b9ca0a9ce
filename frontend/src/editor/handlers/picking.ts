import { t } from "@lingui/core/macro";

import { localized } from "../../language/localized";
import type { Pointed } from "../../map/MapCanvas";
import { nth } from "../../lists";
import type { Place } from "../../map/graph";
import { laneKey } from "../../map/laneShapes";
import { laneWord } from "../placeWords";
import { namedPlace, type PickBy } from "../pick";
import { loopHover, loopUnder, loopWords } from "./detectors";
import { type Editing, type Handler, type Hover, LOOKING, placeHover } from "./handler";
import { segmentAt, segmentHover } from "./segments";

/** A click this near to a lane, or to a light, means it, metres. */
const LANE_REACH = 6;
const LIGHT_REACH = 20;
const NODE_REACH = 2;

const PROMPT = localized((): Record<PickBy, string> => ({
  segment: t`Click a road or junction. Escape stops choosing.`,
  lane: t`Click a lane. Escape stops choosing.`,
  turn: t`Click the road that the turn leads from. Escape stops choosing.`,
  point: t`Click the point of a lane. Escape stops choosing.`,
  light: t`Click a traffic light. Escape stops choosing.`,
  loop: t`Click a lane before the stop line. Escape stops choosing.`,
  node: t`Click a point of a lane inside the region. Escape stops choosing.`,
  goal: t`Click a point of a lane or walkway. Escape stops choosing.`,
  place: t`Click a point of a lane or walkway, or the ground. Escape stops choosing.`,
  ground: t`Click the ground, point after point. Escape stops choosing.`,
}));

/** Names places for a form: a segment, a lane, a turn by its two roads, a point of a lane, a light. */
export const pickingHandler = (editing: Editing): Handler => {
  const { pick, lights } = editing;
  const by = pick.now?.by ?? "segment";
  const whole = by === "segment" || by === "turn";
  const take = (name: string, s = 0): void => pick.taker.current(namedPlace(name, s));
  return {
    ...LOOKING,
    aim: true,
    walks: false,
    under: (at) => {
      if (whole) return segmentHover(editing.picker, at);
      if (by === "goal" || by === "place") return placeHover(anyPlaceAt(editing, at));
      if (by === "ground") return null;
      if (by === "loop") return loopHover(loopUnder(editing, at));
      return by === "light" ? lightHover(editing, at) : placeHover(laneAt(editing, at, by));
    },
    hint: (hover) => said(editing, by, hover),
    pick: (at) => {
      if (whole) pickSegment(editing, at, by, take);
      else if (by === "light") {
        const junction = lights?.junctionAt({ ...at, reach: Math.max(at.reach, LIGHT_REACH) });
        if (junction) take(junction);
        else editing.say(t`There is no traffic light here.`);
      } else if (by === "loop") {
        const loop = loopUnder(editing, at);
        if (loop) take(loop.at, loop.before);
        else editing.say(t`There is no lane before the stop line of this light here.`);
      } else if (by === "goal" || by === "place" || by === "ground") pickPoint(editing, at, by);
      else {
        const place = laneAt(editing, at, by);
        if (!place) editing.say(MISSED()[by]);
        else if (by === "node") take(place.id);
        else take(laneKey(editing.graph, place.index), nth(editing.graph.columns.s, place.index));
      }
    },
  };
};

const MISSED = localized((): Record<"lane" | "point" | "node", string> => ({
  lane: t`There is no lane here.`,
  point: t`There is no lane outside junctions here.`,
  node: t`There is no lane of the region here, or it lies in a junction.`,
}));

/** The nearest node of a lane or walkway, or the ground itself. */
function pickPoint(editing: Editing, at: Pointed, by: "goal" | "place" | "ground"): void {
  const place = by === "ground" ? null : anyPlaceAt(editing, at);
  if (!place && by === "goal") {
    editing.say(t`There is no lane or walkway here.`);
    return;
  }
  const { x, y, hdg } = place ?? { ...at, hdg: 0 };
  editing.pick.taker.current({ name: place?.id ?? "", s: 0, x: cm(x), y: cm(y), hdg });
}

/** Metres to the centimetre. */
const cm = (metres: number): number => Math.round(metres * 100) / 100;

const anyPlaceAt = ({ picker }: Editing, at: Pointed): Place | null =>
  picker.place(at.x, at.y, Math.max(at.reach, NODE_REACH), { vehicles: true, walks: true });

function pickSegment(editing: Editing, at: Pointed, by: PickBy, take: (name: string) => void): void {
  const { graph, picker, pick, say } = editing;
  const row = segmentAt(picker, at);
  if (row === null) return;
  const segment = graph.segmentId(row);
  if (by === "segment") take(segment);
  else if (nth(graph.columns.segments, row).kind === "junction")
    say(t`A turn leads from a road into a road.`);
  else if (pick.now?.from) take(`${pick.now.from}>${segment}`);
  else pick.begin(segment);
}

function lightHover({ lights }: Editing, at: Pointed): Hover | null {
  const junction = lights?.junctionAt({ ...at, reach: Math.max(at.reach, LIGHT_REACH) });
  return junction ? { is: "light", junction } : null;
}

/** The point of a lane; points and nodes lie outside junctions, nodes inside the region. */
function laneAt({ graph, picker, roi }: Editing, at: Pointed, by: PickBy): Place | null {
  const { lane, lane_junctions, segment } = graph.columns;
  const inside = by === "node" ? new Set(roi.flatMap((id) => graph.segmentRow.get(id) ?? [])) : undefined;
  const onRoad = (index: number): boolean => nth(lane_junctions, nth(lane, index)) === null;
  return picker.place(at.x, at.y, Math.max(at.reach, LANE_REACH), {
    vehicles: true,
    walks: false,
    allowed:
      by === "lane" ? undefined : (index) => onRoad(index) && (inside?.has(nth(segment, index)) ?? true),
  });
}

function said({ graph, pick }: Editing, by: PickBy, hover: Hover | null): string {
  if (hover?.is === "loop") return loopWords(hover);
  if (hover?.is === "light") return t`Traffic light at ${graph.names.junction(hover.junction)}`;
  if (hover?.is === "place") return laneWord(graph, hover.place.id);
  const from = pick.now?.from;
  if (hover?.is === "segment") {
    const segment = graph.segmentId(hover.row);
    if (by === "segment" || !from) return graph.names.placeWithId(segment);
    if (segment !== from) return graph.names.place(`${from}>${segment}`);
  }
  return from ? t`From ${graph.names.road(from)}: click the road that the turn leads into.` : PROMPT()[by];
}
