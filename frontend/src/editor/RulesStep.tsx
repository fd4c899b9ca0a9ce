import { Button, Code, Text } from "@mantine/core";
import { useState } from "react";

import type { Edit, ScenarioDocument } from "../api/types";
import { PartCard } from "./DemandParts";
import type { PlacePick } from "./pick";
import { RuleForm } from "./RuleForm";
import {
  actionKind,
  conditionKind,
  type Draft,
  draftOf,
  newItem,
  type Rule,
  ruleOf,
  sentence,
} from "./rules";

/** Rules as sentences, with a form for each that the form knows. */
export function RulesStep({
  document: { actors, flows, rules },
  pick,
  onEdit,
}: {
  document: Pick<ScenarioDocument, "actors" | "flows" | "rules">;
  pick: PlacePick;
  onEdit: (edit: Edit, label?: string) => void;
}) {
  /** Id of the rule whose form is open, "" for a new one. */
  const [open, setOpen] = useState<string | null>(null);
  const ids = [...actors].sort((one, other) => Number(other.ego) - Number(one.ego)).map(({ id }) => id);
  const close = (): void => {
    pick.stop();
    setOpen(null);
  };
  const save = (draft: Draft): void => {
    onEdit({ kind: "set_rule", rule: ruleOf(draft) });
    close();
  };
  const form = (draft: Draft, saveLabel: string) => (
    <RuleForm
      draft={draft}
      saveLabel={saveLabel}
      actors={ids}
      rules={rules.map(({ id }) => id).filter((id) => id !== draft.id)}
      pick={pick}
      onSave={save}
      onCancel={close}
    />
  );
  const opened = (id: string): void => {
    pick.stop();
    setOpen(open === id ? null : id);
  };
  return (
    <>
      <Text size="sm">When something holds, a road user does something; the rest is left to SUMO.</Text>
      {rules.map((rule) => (
        <RuleCard
          key={rule.id}
          rule={rule}
          open={open === rule.id}
          onOpen={() => opened(rule.id)}
          onRemove={() => {
            close();
            onEdit({ kind: "remove_rule", rule: rule.id });
          }}
          form={form}
        />
      ))}
      {open === "" ? (
        <section className="fold" aria-label="New rule">
          {form(newDraft(ids, rules), "Add the rule")}
        </section>
      ) : (
        <Button disabled={ids.length === 0} onClick={() => opened("")}>
          Add a rule
        </Button>
      )}
      {ids.length === 0 && (
        <Text size="sm">
          {flows.length > 0 ? "Rules are made for single road users." : "Place a road user first."}
        </Text>
      )}
    </>
  );
}

function RuleCard({
  rule,
  open,
  onOpen,
  onRemove,
  form,
}: {
  rule: Rule;
  open: boolean;
  onOpen: () => void;
  onRemove: () => void;
  form: (draft: Draft, saveLabel: string) => React.ReactNode;
}) {
  const draft = draftOf(rule);
  return (
    <PartCard name={rule.id} what={rule.actor} onRemove={onRemove}>
      {draft ? (
        <>
          <Text size="sm">{sentence(draft)}</Text>
          <Button
            size="compact-sm"
            variant="default"
            aria-expanded={open}
            aria-label={`${open ? "Close" : "Change"} ${rule.id}`}
            onClick={onOpen}
          >
            {open ? "Close" : "Change"}
          </Button>
          {open && form(draft, "Save the rule")}
        </>
      ) : (
        <Code block tabIndex={0} aria-label={`Rule ${rule.id} as JSON`}>
          {JSON.stringify({ when: rule.when, then: rule.then }, (_, value: unknown) => value ?? undefined, 1)}
        </Code>
      )}
    </PartCard>
  );
}

/** A road user that cuts in, for a begin: of those there are, the first that is not the ego. */
function newDraft(ids: readonly string[], rules: readonly Rule[]): Draft {
  const actor = ids[1] ?? ids[0] ?? "";
  const others = ids.filter((id) => id !== actor);
  const taken = new Set(rules.map(({ id }) => id));
  let number = 1;
  while (taken.has(`rule-${number}`)) number += 1;
  const [condition, action] = others.length > 0 ? ["ttc", "cut_in"] : ["time", "brake"];
  return {
    id: `rule-${number}`,
    actor,
    join: "all",
    conditions: [newItem(condition, conditionKind(condition), others)],
    delay: 0,
    actions: [newItem(action, actionKind(action), others)],
    times: 1,
  };
}

export function ruleNote(rules: readonly Rule[]): string {
  return rules.length === 0 ? "When this, then that" : `${rules.length} rule${rules.length === 1 ? "" : "s"}`;
}
