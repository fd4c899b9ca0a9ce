import { t } from "@lingui/core/macro";

import type { MapEdit, PlaceInfo } from "../api/maps";
import { localized } from "../language/localized";
import { lengthText, speedText } from "../language/units";

/** What can be removed from a place. */
export const partWords = localized((): Record<PlaceInfo["parts"][number], string> => ({
  stop_line: t`stop line`,
  crosswalk: t`crosswalk`,
  light: t`traffic light`,
  sign: t`sign`,
}));

/** An edit of a map in a few words. */
export function editWords(edit: MapEdit): string {
  switch (edit.kind) {
    case "lane_width":
      return t`Lane width ${lengthText(edit.width, 2)}`;
    case "speed_limit":
      return t`Speed limit ${speedText(edit.limit / 3.6)}`;
    case "access":
      return t`Access of a lane`;
    case "road_mark":
      return t`Road mark: ${edit.mark}`;
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
    case "add_island":
      return t`Island added`;
    case "add_light":
      return t`Traffic light added`;
    case "remove_light":
      return t`Traffic light removed`;
    case "move_light":
      return t`Traffic light moved`;
    case "add_sign":
      return t`Sign added`;
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
