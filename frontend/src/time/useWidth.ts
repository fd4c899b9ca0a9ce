import { type RefCallback, useCallback, useRef, useState } from "react";

/** Before anything is laid out, pixels. */
const UNKNOWN = 600;

/** The width of an element in pixels, as it changes. */
export function useWidth(): [RefCallback<HTMLElement>, number] {
  const [width, setWidth] = useState(UNKNOWN);
  const observer = useRef<ResizeObserver | null>(null);
  const ref = useCallback<RefCallback<HTMLElement>>((element) => {
    observer.current?.disconnect();
    if (!element || typeof ResizeObserver === "undefined") return;
    const measure = (): void => {
      const found = element.getBoundingClientRect().width;
      if (found > 1) setWidth(found);
    };
    observer.current = new ResizeObserver(measure);
    observer.current.observe(element);
    measure();
  }, []);
  return [ref, width];
}
