/** The element that must be there; asking for another one is a fault of the page, and said as such. */
export function nth<T>(list: ArrayLike<T>, index: number): T {
  const found = list[index];
  if (found === undefined) throw new RangeError(`there is no element ${index} of ${list.length}`);
  return found;
}

/** Whether a text, such as the choice from a list, is a key of a table. */
export const isKey = <T extends object>(table: T, key: string | null): key is Extract<keyof T, string> =>
  key !== null && Object.hasOwn(table, key);
