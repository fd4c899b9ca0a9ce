import { Text } from "@mantine/core";

import type { Problem } from "../api/types";
import { IconWarn } from "../ui/icons";
import { count } from "../ui/words";

/** Length of the list; solving some shows the rest. */
const SHOWN = 50;

/** What the server finds wrong, each leading to its place. */
export function Problems({
  problems,
  onShow,
}: {
  problems: readonly Problem[];
  onShow: (problem: Problem) => void;
}) {
  if (problems.length === 0) return null;
  const sorted = [...problems].sort(
    (a, b) => Number(b.severity === "error") - Number(a.severity === "error"),
  );
  return (
    <section className="problems" aria-label="Problems">
      <Text size="sm" fw={700} px={8} pb={2} role="status">
        {count(problems.length, "problem")} found
      </Text>
      {sorted.slice(0, SHOWN).map((problem) => (
        <button
          type="button"
          className="problem"
          key={`${problem.where} ${problem.code} ${problem.message}`}
          onClick={() => onShow(problem)}
        >
          <span
            className="problem-sign"
            data-severity={problem.severity}
            role="img"
            aria-label={problem.severity === "error" ? "Must be solved" : "Warning"}
          >
            <IconWarn />
          </span>
          <span className="problem-text">{problem.message}</span>
        </button>
      ))}
      {sorted.length > SHOWN && (
        <Text size="sm" px={8}>
          and {sorted.length - SHOWN} more
        </Text>
      )}
    </section>
  );
}
