import { t } from "@lingui/core/macro";
import { useRef, useState } from "react";

import { api } from "../api/client";
import { exchange } from "../api/exchange";
import { go } from "../ui/address";
import { reasonOf } from "../ui/reason";
import { sentence } from "../ui/words";
import { served } from "../language/served";

/** An import that is running, or that was refused; its files can be sent again with others. */
export interface ImportState {
  files: readonly File[];
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

export const isXosc = ({ name }: File): boolean => /\.xosc$/i.test(name);

/** Imports files, of OpenSCENARIO if nothing else is said, and then shows the report. */
export function useImport(): Import {
  const [state, setState] = useState<ImportState | null>(null);
  const busy = useRef(false);
  const begin = (files: readonly File[], of = "openscenario"): void => {
    if (busy.current || files.length === 0) return;
    busy.current = true;
    setState({ files, step: t`Sending the files`, job: null, refusal: null });
    exchange
      .bring(of, files, ({ id, step }) =>
        setState({ files, step: sentence(served(step)), job: id, refusal: null }),
      )
      .then(
        (name) => {
          setState(null);
          if (name !== null) go({ view: "imported", scenario: name });
        },
        (error: unknown) => setState({ files, step: "", job: null, refusal: reasonOf(error) }),
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
