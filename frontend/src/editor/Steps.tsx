import { type ReactNode, useEffect, useRef } from "react";

import { IconCheck } from "../ui/icons";
import { type Step, STEPS } from "./scene";

export interface StepText {
  title: string;
  note: string;
  done: boolean;
  body: ReactNode;
}

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
  useEffect(() => {
    list.current?.querySelector("[aria-expanded=true]")?.scrollIntoView({ block: "nearest" });
    list.current?.querySelector(".step-body")?.scrollIntoView({ block: "nearest" });
  }, [open]);
  return (
    <div className="steps" ref={list}>
      {STEPS.map((step, n) => {
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
              <span className="step-number" aria-hidden="true">
                {done && !expanded ? <IconCheck size={15} /> : n + 1}
              </span>
              <span>
                <span className="step-title">{title}</span>
                <br />
                <span className="step-note">{note}</span>
              </span>
            </button>
            {expanded && <div className="step-body">{body}</div>}
          </section>
        );
      })}
    </div>
  );
}
