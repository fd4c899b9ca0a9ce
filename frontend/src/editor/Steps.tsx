import { t } from "@lingui/core/macro";
import { type ReactNode, useEffect, useId, useRef } from "react";

import { localized } from "../language/localized";
import { IconCheck } from "../ui/icons";
import { type Step, STEP_GROUPS, type StepGroup } from "./scene";

/** Pixels of a window in which all lies below each other; those of narrow.css. */
const NARROW = 900;

export interface StepText {
  title: string;
  note: string;
  done: boolean;
  body: ReactNode;
}

const GROUP_WORD = localized((): Record<StepGroup, string> => ({
  place: t`Place`,
  traffic: t`Traffic`,
  control: t`Control`,
  evaluate: t`Evaluate`,
}));

/** The guided order; every step can be opened at any time. */
export function Steps({
  open,
  onOpen,
  steps,
}: {
  open: Step;
  onOpen: (step: Step) => void;
  steps: Record<Step, StepText>;
}) {
  const list = useRef<HTMLDivElement>(null);
  const id = useId();
  useEffect(() => {
    const head = list.current?.querySelector("[aria-expanded=true]");
    // Where the page itself scrolls, a long form must not push its heading below the map.
    if (innerWidth <= NARROW) void head?.scrollIntoView({ block: "start" });
    else {
      void head?.scrollIntoView({ block: "nearest" });
      void list.current?.querySelector(".step-body")?.scrollIntoView({ block: "nearest" });
    }
  }, [open]);
  return (
    <div className="steps" ref={list}>
      {(Object.keys(STEP_GROUPS) as StepGroup[]).map((group) => (
        <div key={group} role="group" aria-labelledby={`${id}-${group}`}>
          <h2 id={`${id}-${group}`} className="step-group">
            {GROUP_WORD()[group]}
          </h2>
          {STEP_GROUPS[group].map((step) => {
            const { title, note, done, body } = steps[step];
            const expanded = open === step;
            return (
              <section key={step} aria-label={title}>
                <button
                  type="button"
                  className="step-head"
                  aria-expanded={expanded}
                  data-done={done}
                  onClick={() => onOpen(step)}
                >
                  <span className="step-mark" aria-hidden="true">
                    {done && <IconCheck size={13} />}
                  </span>
                  <span className="step-words">
                    <span className="step-title">{title}</span> <span className="step-note">{note}</span>
                  </span>
                </button>
                {expanded && <div className="step-body">{body}</div>}
              </section>
            );
          })}
        </div>
      ))}
    </div>
  );
}
