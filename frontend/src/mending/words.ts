import { t } from "@lingui/core/macro";

import type { MapEdit, PlaceInfo } from "../api/maps";
import { laneKind } from "../editor/placeWords";
import { localized } from "../language/localized";
import { lengthText, speedText } from "../language/units";

/** What can be removed from a place. */
export const partWords = localized((): Record<PlaceInfo["parts"][number], string> => ({
  stop_line: t`stop line`,
  crosswalk: t`crosswalk`,
  light: t`traffic light`,
  sign: t`sign`,
  island: t`island`,
  object: t`object`,
}));

/** Edits that need a second place. */
export type Aim = Extract<MapEdit, { to?: unknown }>["kind"];

/** What the second place of an edit is. */
export function aimWords(kind: Aim): string {
  switch (kind) {
    case "add_turn":
    case "remove_turn":
      return t`Choose the lane behind the junction on the map.`;
    case "bend_border":
      return t`Choose the place through which the lane border is to lead.`;
    case "bend_road":
      return t`Choose the place to which the road is to be bent.`;
    case "move_road_end":
      return t`Choose the place to which the end of the road is moved, as far from the first place.`;
    case "join_junctions":
      return t`Choose the other junction on the map.`;
    default:
      return t`Choose the new place on the map.`;
  }
}

/** Signs that can be put up, as Germany numbers them. */
export const signWords = localized((): Record<"205" | "206" | "267" | "274", string> => ({
  "206": t`Stop`,
  "205": t`Give way`,
  "274": t`Speed limit`,
  "267": t`No entry`,
}));

/** What a lane can be for. */
export const laneTypes = [
  "driving",
  "bus",
  "biking",
  "parking",
  "sidewalk",
  "shoulder",
  "restricted",
] as const;

/** Road marks that can be painted. */
export const markWords = localized((): Record<Extract<MapEdit, { kind: "road_mark" }>["mark"], string> => ({
  broken: t`broken`,
  solid: t`solid`,
  "solid solid": t`two solid lines`,
  "solid broken": t`solid inside, broken outside`,
  "broken solid": t`broken inside, solid outside`,
  "broken broken": t`two broken lines`,
  curb: t`curb`,
  none: t`none`,
}));

/** An edit of a map in a few words. */
export function editWords(edit: MapEdit): string {
  switch (edit.kind) {
    case "lane_width":
      return t`Lane width ${lengthText(edit.width, 2)}`;
    case "speed_limit":
      return t`Speed limit ${speedText(edit.limit / 3.6)}`;
    case "access":
      return edit.type ? t`Lane for: ${laneKind(edit.type)}` : t`Access of a lane`;
    case "road_mark":
      return t`Road mark: ${markWords()[edit.mark]}`;
    case "add_stop_line":
      return t`Stop line added`;
    case "remove_stop_line":
      return t`Stop line removed`;
    case "move_stop_line":
      return t`Stop line moved`;
    case "add_crosswalk":
      return t`Crosswalk added`;
    case "remove_crosswalk":
      return t`Crosswalk removed`;
    case "move_crosswalk":
      return t`Crosswalk moved`;
    case "remove_island":
      return t`Island removed`;
    case "move_island":
      return t`Island moved`;
    case "remove_object":
      return t`Object removed`;
    case "move_object":
      return t`Object moved`;
    case "bend_border":
      return t`Lane border bent`;
    case "bend_road":
      return t`Road bent`;
    case "move_road_end":
      return t`End of a road moved`;
    case "join_junctions":
      return t`Junctions joined`;
    case "add_island":
      return t`Island added`;
    case "add_light":
      return t`Traffic light added`;
    case "remove_light":
      return t`Traffic light removed`;
    case "move_light":
      return t`Traffic light moved`;
    case "add_sign":
      return t`Sign added: ${(signWords() as Record<string, string>)[edit.type] ?? edit.type}`;
    case "remove_sign":
      return t`Sign removed`;
    case "move_sign":
      return t`Sign moved`;
    case "add_turn":
      return t`Turn added`;
    case "remove_turn":
      return t`Turn removed`;
  }
}
