import { t } from "@lingui/core/macro";
import { useRef, useState } from "react";

import { api } from "../api/client";
import { exchange } from "../api/exchange";
import { recordings } from "../api/recordings";
import type { Job } from "../api/types";
import { go } from "../ui/address";
import { reasonOf } from "../ui/reason";
import { sentence } from "../ui/words";
import { served } from "../language/served";

/** An import that is running, or that was refused; its files can be sent again with others. */
export interface ImportState {
  files: readonly File[];
  /** What a refused one was read as. */
  of?: string;
  step: string;
  job: string | null;
  refusal: string | null;
}

export interface Import {
  state: ImportState | null;
  begin: (files: readonly File[], of?: string) => void;
  cancel: () => void;
  close: () => void;
}

/** The format whose files are recordings: they are looked at before a scenario is made of them. */
export const RECORDED = "trajectories";

export const isXosc = ({ name }: File): boolean => /\.xosc$/i.test(name);

/** Imports files, of OpenSCENARIO if nothing else is said, and then shows the report. */
export function useImport(): Import {
  const [state, setState] = useState<ImportState | null>(null);
  const busy = useRef(false);
  const begin = (files: readonly File[], of = "openscenario"): void => {
    if (busy.current || files.length === 0) return;
    busy.current = true;
    setState({ files, step: t`Sending the files`, job: null, refusal: null });
    const onStep = ({ id, step }: Job): void =>
      setState({ files, step: sentence(served(step)), job: id, refusal: null });
    const recorded = of === RECORDED;
    (recorded ? recordings.bring(files, onStep) : exchange.bring(of, files, onStep))
      .then(
        (name) => {
          setState(null);
          if (name !== null)
            go(recorded ? { view: "recording", recording: name } : { view: "imported", scenario: name });
        },
        (error: unknown) => setState({ files, of, step: "", job: null, refusal: reasonOf(error) }),
      )
      .finally(() => (busy.current = false));
  };
  return {
    state,
    begin,
    // Refused only when it has ended meanwhile, which the page learns by itself.
    cancel: () => void (state?.job && api.cancelJob(state.job).catch(() => undefined)),
    close: () => setState(null),
  };
}
