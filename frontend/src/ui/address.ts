import { useSyncExternalStore } from "react";

import { pathOf } from "./kept";

/** Where in the page one is; kept in the address, so that reload and the back button work. */
export type Address =
  | { view: "catalogue" }
  | { view: "editor"; scenario: string }
  | { view: "imported"; scenario: string }
  | { view: "run"; scenario: string; run: string }
  | { view: "runs"; scenario: string }
  | { view: "sweeps"; scenario: string }
  | { view: "sweep"; scenario: string; sweep: string }
  | { view: "mend"; map: string }
  | { view: "recording"; recording: string }
  | { view: "studies" }
  | { view: "study"; study: string };

export function parseAddress(hash: string): Address {
  const [view, scenario, run] = pathOf(hash).replace(/^#\/?/, "").split("/").map(decode);
  if (view === "edit" && scenario) return { view: "editor", scenario };
  if (view === "imported" && scenario) return { view: "imported", scenario };
  if (view === "run" && scenario && run) return { view: "run", scenario, run };
  if (view === "runs" && scenario) return { view: "runs", scenario };
  if (view === "sweeps" && scenario) return { view: "sweeps", scenario };
  if (view === "sweep" && scenario && run) return { view: "sweep", scenario, sweep: run };
  if (view === "mend" && scenario) return { view, map: scenario };
  if (view === "recording" && scenario) return { view, recording: scenario };
  if (view === "studies") return { view };
  if (view === "study" && scenario) return { view, study: scenario };
  return { view: "catalogue" };
}

/** Inverse of {@link parseAddress}. */
export function hashOf(address: Address): string {
  const enc = encodeURIComponent;
  if (address.view === "editor") return `#/edit/${enc(address.scenario)}`;
  if (address.view === "imported") return `#/imported/${enc(address.scenario)}`;
  if (address.view === "run") return `#/run/${enc(address.scenario)}/${enc(address.run)}`;
  if (address.view === "runs") return `#/runs/${enc(address.scenario)}`;
  if (address.view === "sweeps") return `#/sweeps/${enc(address.scenario)}`;
  if (address.view === "sweep") return `#/sweep/${enc(address.scenario)}/${enc(address.sweep)}`;
  if (address.view === "mend") return `#/mend/${enc(address.map)}`;
  if (address.view === "recording") return `#/recording/${enc(address.recording)}`;
  if (address.view === "studies") return "#/studies";
  if (address.view === "study") return `#/study/${enc(address.study)}`;
  return "#/";
}

export const go = (address: Address): void => {
  location.hash = hashOf(address);
};

export function useAddress(): Address {
  const hash = useSyncExternalStore(
    (changed) => {
      addEventListener("hashchange", changed);
      return () => removeEventListener("hashchange", changed);
    },
    () => pathOf(location.hash),
  );
  return parseAddress(hash);
}

function decode(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}
