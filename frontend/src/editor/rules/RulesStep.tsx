import { Button, Text } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import type { Edit, ScenarioDocument } from "../../api/types";
import { forgetForm, useKeptForm } from "../../ui/keptForm";
import { PartCard } from "../DemandParts";
import { OpenAndShow } from "../FormParts";
import type { PlacePick } from "../pick";
import { type Draft, draftOf, newDraft, type Rule, rulesOf, sentence } from "./draft";
import { RULE_FORM, RuleForm } from "./RuleForm";

/** Rules as sentences, with a form for each; where they act is on the map. */
export function RulesStep({
  document: { actors, flows, rules },
  pick,
  onDraft,
  onEdit,
  onShow,
}: {
  document: Pick<ScenarioDocument, "actors" | "flows" | "rules">;
  pick: PlacePick;
  /** The rule whose form is open, as it is now. */
  onDraft: (draft: Draft | null) => void;
  onEdit: (edit: Edit | readonly Edit[], label?: string) => void;
  onShow: (rule: Rule) => void;
}) {
  /** Id of the rule whose form is open, "" for a new one. */
  const [open, setOpen] = useKeptForm<string | null>("open rule", null);
  const ids = [...actors].sort((one, other) => Number(other.ego) - Number(one.ego)).map(({ id }) => id);
  const walkers = actors.filter(({ category }) => category === "pedestrian").map(({ id }) => id);
  const idle = walkers.filter((id) => rules.every(({ actor }) => actor !== id));
  const turnTo = (id: string | null): void => {
    pick.stop();
    forgetForm(RULE_FORM);
    setOpen(id);
  };
  const close = (): void => turnTo(null);
  const save = (draft: Draft): void => {
    const renamed = open && open !== draft.id.trim() ? { instead_of: open } : {};
    const taken = rules.map(({ id }) => id);
    const made = rulesOf(draft, idle, taken).map((rule): Edit => ({ kind: "set_rule", rule, ...renamed }));
    if (made.length > 1) onEdit(made, t`Add the rule ${draft.id.trim()}`);
    else onEdit(made);
    close();
  };
  const form = (draft: Draft, saveLabel: string) => (
    <RuleForm
      draft={draft}
      saveLabel={saveLabel}
      actors={ids}
      walkers={walkers}
      idle={idle}
      rules={rules.map(({ id }) => id).filter((id) => id !== open)}
      pick={pick}
      onDraft={onDraft}
      onSave={save}
      onCancel={close}
    />
  );
  const opened = (id: string): void => turnTo(open === id ? null : id);
  return (
    <>
      <Text size="sm">
        <Trans>When something holds, a road user does something; the rest is left to SUMO.</Trans>
      </Text>
      {rules.map((rule) => {
        const draft = draftOf(rule);
        return (
          <PartCard
            key={rule.id}
            name={rule.id}
            what={rule.actor}
            onRemove={() => {
              close();
              onEdit({ kind: "remove_rule", rule: rule.id });
            }}
          >
            <Text size="sm">{sentence(draft)}</Text>
            <OpenAndShow
              part={rule.id}
              open={open === rule.id}
              onOpen={() => opened(rule.id)}
              onShow={() => onShow(rule)}
            />
            {open === rule.id && form(draft, t`Save the rule`)}
          </PartCard>
        );
      })}
      {open === "" ? (
        <section className="fold" aria-label={t`New rule`}>
          {form(newDraft(ids, rules, walkers), t`Add the rule`)}
        </section>
      ) : (
        <Button disabled={ids.length === 0} onClick={() => opened("")}>
          <Trans>Add a rule</Trans>
        </Button>
      )}
      {ids.length === 0 && (
        <Text size="sm">
          {flows.length > 0 ? t`Rules are made for single road users.` : t`Place a road user first.`}
        </Text>
      )}
    </>
  );
}

export const ruleNote = (rules: readonly Rule[]): string =>
  rules.length === 0 ? t`When this, then that` : plural(rules.length, { one: "# rule", other: "# rules" });
