/** Marks what lies over a map and has its own use of the pointer, which it follows all over the page. */
export const OWN_POINTER = "data-own-pointer";

export const hasOwnPointer = (target: EventTarget): boolean =>
  target instanceof Element && target.closest(`[${OWN_POINTER}]`) !== null;
