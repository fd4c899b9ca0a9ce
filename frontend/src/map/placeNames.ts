import { t } from "@lingui/core/macro";

import type { MapNames, Side } from "../api/types";
import { localized } from "../language/localized";
import { isKey } from "../lists";

const SIDE = localized((): Record<Side, string> => ({
  east: t`east`,
  "north-east": t`north-east`,
  north: t`north`,
  "north-west": t`north-west`,
  west: t`west`,
  "south-west": t`south-west`,
  south: t`south`,
  "south-east": t`south-east`,
}));

/** A side, or what else distinguishes places of one name. */
const sideWord = (side: string): string => (isKey(SIDE(), side) ? SIDE()[side] : side);

type Junction = MapNames["junctions"][number];
type Road = MapNames["roads"][number];

/** Names of the places of a map by streets and the compass; ids where nothing is known of them. */
export class PlaceNames {
  private readonly junctions: ReadonlyMap<string, Junction>;
  private readonly roads: ReadonlyMap<string, Road>;

  constructor(names: MapNames = { junctions: [], roads: [] }) {
    this.junctions = new Map(names.junctions.map((one) => [one.id, one]));
    this.roads = new Map(names.roads.map((one) => [one.id, one]));
  }

  /** `East Street 5 / North Street 3`, or `Junction 10`; of its segment `j10` or its id `10`. */
  junction(id: string): string {
    const bare = id.replace(/^j(?=\d)/, "");
    const { streets, which } = this.legsOf(id) ?? { streets: [], which: "" };
    const name = streets.length > 0 ? streets.join(" / ") : t`Junction ${bare}`;
    return which ? `${name} (${sideWord(which)})` : name;
  }

  /** `North Street 3`, or `Road 12`. */
  street(segment: string): string {
    const bare = segment.replace(/^r(?=\d)/, "");
    return this.roads.get(segment)?.street || t`Road ${bare}`;
  }

  /** `North Street 3 between East Street 2 and East Street 3`. */
  road(segment: string): string {
    const found = this.roads.get(segment);
    if (!found) return segment;
    const street = this.street(segment);
    const crossed = found.ends.map((end) => end.street || this.junction(end.junction));
    const [first, second] = [...new Set(crossed)].sort();
    if (first === undefined) return street;
    if (second !== undefined) return t`${street} between ${first} and ${second}`;
    return found.side ? t`${street}, ${sideWord(found.side)} of ${first}` : t`${street} at ${first}`;
  }

  /** A segment, a turn `r1>r2` or an approach `r1>j10` at its junction, or a lane by its id. */
  place(id: string): string {
    const [from = "", ...into] = id.split(">");
    const last = into.at(-1);
    if (last === undefined) return this.junctions.has(id) ? this.junction(id) : this.road(id);
    const ends = this.junctions.has(last) ? [from] : [from, last];
    const at = [...this.junctions.values()].find(
      (one) =>
        (ends.length > 1 || one.id === last) &&
        ends.every((end) => one.legs.some(({ segment }) => segment === end)),
    );
    if (!at) return id;
    const approaches = new ApproachNames(this, { junctions: [at.id], lanes: [] });
    return `${this.junction(at.id)}, ${approaches.movement(ends.join(">"))}`;
  }

  /** With the id behind it, by which it can be found and typed. */
  placeWithId(id: string): string {
    const name = this.place(id);
    return name === id ? id : `${name} (${id})`;
  }

  legsOf(junction: string): Junction | undefined {
    return this.junctions.get(junction) ?? this.junctions.get(`j${junction}`);
  }
}

/** Of a map that is not there. */
export const NO_NAMES = new PlaceNames();

const TURN = localized((): Record<string, string> => ({
  left: t`left turn`,
  straight: t`straight on`,
  right: t`right turn`,
  turnaround: t`U-turn`,
}));

interface Lane {
  at: string;
  approach: string;
}

/** Names of the approaches of a traffic light: the side from which they come, and where they turn. */
export class ApproachNames {
  private readonly sides = new Map<string, Side>();
  private readonly lanes: ReadonlyMap<string, string>;

  constructor(
    private readonly names: PlaceNames,
    light: { junctions: readonly string[]; lanes: readonly Lane[] } | null,
  ) {
    for (const junction of light?.junctions ?? [])
      for (const { segment, side } of names.legsOf(junction)?.legs ?? [])
        if (!this.sides.has(segment)) this.sides.set(segment, side);
    this.lanes = new Map(light?.lanes.map(({ at, approach }) => [at, approach]));
  }

  /** `north`; with its street where another leg lies on the same side. */
  private side(segment: string): string | null {
    const side = this.sides.get(segment);
    if (side === undefined) return null;
    const alike = [...this.sides].filter(([, other]) => other === side).map(([leg]) => leg);
    if (alike.length === 1) return SIDE()[side];
    const street = this.names.street(segment);
    const same = alike.some((leg) => leg !== segment && this.names.street(leg) === street);
    return `${SIDE()[side]} (${same ? this.names.placeWithId(segment) : street})`;
  }

  /** `from the north`; the id of a segment that is no leg. */
  approach(segment: string): string {
    const side = this.side(segment);
    return side === null ? segment : t`from the ${side}`;
  }

  /** `from the north, lane 2`: counted from the middle of the road, as in its id. */
  lane(at: string): string {
    const approach = this.lanes.get(at);
    const number = Math.abs(Number(at.split(".").at(-1)));
    if (approach === undefined || this.side(approach) === null || !number) return at;
    const name = (lane: string): string => `${this.lanes.get(lane) ?? ""} ${lane.split(".").at(-1)}`;
    const alike = [...this.lanes.keys()].filter((one) => name(one) === name(at));
    const from = this.approach(approach);
    const which = alike.length > 1 ? at : number;
    return t`${from}, lane ${which}`;
  }

  /** `from the north, left turn` for `r1 left`, `from the north to the east` for `r1>r2`, and so on. */
  movement(name: string): string {
    const { from, turn } = this.parts(name);
    return turn ? `${from}, ${turn}` : from;
  }

  /** Several, those of an approach together: `from the north: straight on, right turn; from the east`. */
  movements(names: readonly string[]): string {
    const found = new Map<string, string[]>();
    for (const name of names) {
      const { from, turn } = this.parts(name);
      found.set(from, [...(found.get(from) ?? []), ...(turn ? [turn] : [])]);
    }
    return [...found].map(([from, turns]) => [from, turns.join(", ")].filter(Boolean).join(": ")).join("; ");
  }

  private parts(name: string): { from: string; turn: string | null } {
    const [first = "", second = ""] = name.split(" ");
    const side = this.side(first === "walk" ? second : first);
    if (first === "walk") return { from: side === null ? name : t`crossing in the ${side}`, turn: null };
    if (side !== null)
      return { from: this.approach(first), turn: second ? (TURN()[second] ?? second) : null };
    const [from = "", ...into] = name.split(">");
    const [one, other] = [this.side(from), this.side(into.at(-1) ?? "")];
    if (one !== null && other !== null)
      return from === into.at(-1)
        ? { from: this.approach(from), turn: TURN().turnaround ?? null }
        : { from: t`from the ${one} to the ${other}`, turn: null };
    return { from: into.length === 0 ? this.lane(name) : name, turn: null };
  }
}
