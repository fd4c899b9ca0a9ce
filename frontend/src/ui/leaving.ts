import { useEffect } from "react";

/**
 * Finishes what is being typed when the page is left, closed or loaded anew: fields are sent when they
 * lose the focus, and leaving alone does not take it from them.
 */
export function useFinishedOnLeaving(): void {
  useEffect(() => {
    const finish = (): void => {
      if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
    };
    const events = ["beforeunload", "pagehide", "popstate"] as const;
    for (const name of events) addEventListener(name, finish, { capture: true });
    return () => {
      for (const name of events) removeEventListener(name, finish, { capture: true });
    };
  }, []);
}

/** Lets the browser ask before the window is closed or loaded anew while something is not saved. */
export function useAskBeforeClosing(unsaved: boolean): void {
  useEffect(() => {
    if (!unsaved) return;
    const ask = (event: BeforeUnloadEvent): void => event.preventDefault();
    addEventListener("beforeunload", ask);
    return () => removeEventListener("beforeunload", ask);
  }, [unsaved]);
}
