import { useSyncExternalStore } from "react";

/** Where in the page one is; kept in the address, so that reload and the back button work. */
export type Route =
  | { view: "catalogue" }
  | { view: "editor"; scenario: string }
  | { view: "run"; scenario: string; run: string }
  | { view: "runs"; scenario: string };

export function parseRoute(hash: string): Route {
  const [view, scenario, run] = hash.replace(/^#\/?/, "").split("/").map(decode);
  if (view === "edit" && scenario) return { view: "editor", scenario };
  if (view === "run" && scenario && run) return { view: "run", scenario, run };
  if (view === "runs" && scenario) return { view: "runs", scenario };
  return { view: "catalogue" };
}

/** Inverse of {@link parseRoute}. */
export function hashOf(route: Route): string {
  const enc = encodeURIComponent;
  if (route.view === "editor") return `#/edit/${enc(route.scenario)}`;
  if (route.view === "run") return `#/run/${enc(route.scenario)}/${enc(route.run)}`;
  if (route.view === "runs") return `#/runs/${enc(route.scenario)}`;
  return "#/";
}

export const go = (route: Route): void => { location.hash = hashOf(route); };

export function useRoute(): Route {
  const hash = useSyncExternalStore(
    (changed) => {
      addEventListener("hashchange", changed);
      return () => removeEventListener("hashchange", changed);
    },
    () => location.hash,
  );
  return parseRoute(hash);
}

function decode(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}
