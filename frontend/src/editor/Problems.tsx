import { Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import { useState } from "react";

import type { Problem } from "../api/types";
import type { Graph } from "../map/graph";
import { IconWarn } from "../ui/icons";
import { grouped, inWords, type ProblemGroup } from "./problemGroups";

/** Length of the list; solving some shows the rest. */
const SHOWN = 50;

/** What the server finds wrong, each leading to its place; what is wrong of many is said once. */
export function Problems({
  problems,
  graph,
  onShow,
}: {
  problems: readonly Problem[];
  graph: Graph;
  onShow: (problem: Problem) => void;
}) {
  if (problems.length === 0) return null;
  return (
    <section className="problems" aria-label={t`Problems`}>
      <Text size="sm" fw={700} px={8} pb={2} role="status">
        <Trans>
          <Plural value={problems.length} one="# problem" other="# problems" /> found
        </Trans>
      </Text>
      {grouped(problems, graph).map((group) => (
        <Group key={group.key} group={group} graph={graph} onShow={onShow} />
      ))}
    </section>
  );
}

function Group({
  group: { title, problems },
  graph,
  onShow,
}: {
  group: ProblemGroup;
  graph: Graph;
  onShow: (problem: Problem) => void;
}) {
  const [open, setOpen] = useState(false);
  const rows = problems.slice(0, SHOWN).map((problem, n) => (
    <button
      type="button"
      className="problem"
      key={`${n} ${problem.where} ${problem.code}`}
      onClick={() => onShow(problem)}
    >
      <Sign problem={problem} />
      <span className="problem-text">{inWords(problem, graph)}</span>
    </button>
  ));
  const [first] = problems;
  if (title === null || !first) return rows;
  return (
    <>
      <button type="button" className="problem" aria-expanded={open} onClick={() => setOpen(!open)}>
        <Sign problem={first} />
        <span className="problem-text">{title}</span>
      </button>
      {open && (
        <div className="problem-many">
          {rows}
          {problems.length > SHOWN && (
            <Text size="sm" px={8}>
              <Trans>and {problems.length - SHOWN} more</Trans>
            </Text>
          )}
        </div>
      )}
    </>
  );
}

const Sign = ({ problem: { severity } }: { problem: Problem }) => (
  <span
    className="problem-sign"
    data-severity={severity}
    role="img"
    aria-label={severity === "error" ? t`Must be solved` : t`Warning`}
  >
    <IconWarn />
  </span>
);
