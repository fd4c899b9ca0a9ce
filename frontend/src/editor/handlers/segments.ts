import type { Pointed } from "../../map/MapCanvas";
import type { Picker } from "../../map/picking";
import type { Hover } from "./handler";

/** A click this near to a segment means it, metres. */
const REACH = 8;

/** Row of the segment that is pointed at. */
export const segmentAt = (picker: Picker, at: Pointed): number | null =>
  picker.segment(at.x, at.y, Math.max(at.reach, REACH));

export function segmentHover(picker: Picker, at: Pointed): Hover | null {
  const row = segmentAt(picker, at);
  return row === null ? null : { is: "segment", row };
}
