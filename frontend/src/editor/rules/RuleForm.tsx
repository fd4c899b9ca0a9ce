import { Button, Checkbox, Group, Stack, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useEffect } from "react";

import { useKeptForm } from "../../ui/keptForm";
import { Committed } from "../Committed";
import { CommittedText } from "../FormParts";
import { WhenForm } from "./ConditionForm";
import { actionsFor, canWait, type Draft, missing, sentence } from "./draft";
import { type About, ChoiceInput } from "./FieldInput";
import { ThenForm } from "./ThenForm";

/** Under which an open form is kept. */
export const RULE_FORM = "rule";

/** A rule that is being made or changed: nothing is sent before it is whole. */
export function RuleForm({
  draft: begun,
  saveLabel,
  actors,
  rules,
  walkers,
  idle,
  pick,
  onDraft,
  onSave,
  onCancel,
}: About & {
  draft: Draft;
  saveLabel: string;
  /** Of the actors those on foot. */
  walkers: readonly string[];
  /** Of these, those whom no rule moves. */
  idle: readonly string[];
  /** With every change, and null at the end: for the map. */
  onDraft: (draft: Draft | null) => void;
  onSave: (draft: Draft) => void;
  onCancel: () => void;
}) {
  const [draft, setDraft] = useKeptForm(RULE_FORM, begun);
  useEffect(() => {
    onDraft(draft);
    return () => onDraft(null);
  }, [draft, onDraft]);
  const put = (fields: Partial<Draft>): void => setDraft((old) => ({ ...old, ...fields }));
  const taken = rules.includes(draft.id.trim());
  const lacking = missing(draft);
  const about = { actors, rules, pick, others: actors.filter((one) => one !== draft.actor) };
  const actBy = (actor: string): void => {
    const others = actors.filter((one) => one !== actor);
    put({ actor, then: actionsFor(draft.then, walkers.includes(actor), others) });
  };
  return (
    <Stack gap={8}>
      <CommittedText label={t`Name`} value={draft.id} maxLength={60} onCommit={(id) => put({ id })} />
      <ChoiceInput
        label={t`Who acts`}
        value={draft.actor}
        data={actors.map((one) => ({ value: one, label: one }))}
        onChange={(actor) => actBy(actor ?? "")}
      />
      <WhenForm condition={draft.when} onChange={(when) => put({ when })} {...about} />
      <ThenForm
        then={draft.then}
        onFoot={walkers.includes(draft.actor)}
        onChange={(then) => put({ then })}
        {...about}
      />
      {canWait(draft, idle) && (
        <Checkbox
          label={t`Waits until then`}
          description={t`By a rule of its own`}
          checked={draft.waits ?? false}
          onChange={({ currentTarget: { checked } }) => put({ waits: checked })}
        />
      )}
      <Committed
        label={t`Fires at most`}
        suffix={draft.times === 1 ? t` time` : t` times`}
        min={1}
        max={100_000}
        digits={0}
        value={draft.times}
        onCommit={(times) => put({ times: times ?? 1 })}
      />
      <Text size="sm" role="status">
        {sentence(draft)}
      </Text>
      {lacking.length > 0 && (
        <Text size="sm">
          <Trans>Still to give: {lacking.join(", ")}.</Trans>
        </Text>
      )}
      {taken && (
        <Text size="sm">
          <Trans>There is a rule {draft.id} already; choose another name.</Trans>
        </Text>
      )}
      <Group gap={6}>
        <Button disabled={lacking.length > 0 || taken} onClick={() => onSave(draft)}>
          {saveLabel}
        </Button>
        <Button variant="default" onClick={onCancel}>
          <Trans>Cancel</Trans>
        </Button>
      </Group>
    </Stack>
  );
}
