/** Rows of a long table that are worth drawing: first and last (exclusive), with some around. */
export function rowsInSight(
  count: number,
  rowHeight: number,
  top: number,
  height: number,
  spare = 10,
): [first: number, end: number] {
  const first = Math.max(0, Math.min(count, Math.floor(top / rowHeight)) - spare);
  return [first, Math.min(count, Math.ceil((top + height) / rowHeight) + spare)];
}
