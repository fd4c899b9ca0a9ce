import { Button, Group, Select } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { inSentence } from "../../ui/words";
import { nth } from "../../lists";
import { ListButtons } from "../FormParts";
import { ACTION_KINDS, actionKind, canDo } from "./actionKinds";
import { firstAction, type Item, newItem, settled } from "./draft";
import { type About, FieldInput } from "./FieldInput";

type Then = readonly (readonly Item[])[];

/** What a road user can do, and what it is to do. */
const kindsFor = (onFoot: boolean, chosen: string): { value: string; label: string }[] =>
  Object.entries(ACTION_KINDS())
    .filter(([value]) => canDo(value, onFoot) || value === chosen)
    .map(([value, { label }]) => ({ value, label }));

/** What the road user then does: actions in their order, of which each may be several at once. */
export function ThenForm({
  then,
  onFoot,
  onChange,
  ...about
}: About & {
  others: readonly string[];
  then: Then;
  /** Whether the road user walks. */
  onFoot: boolean;
  onChange: (then: Then) => void;
}) {
  const fresh = (): Item => firstAction(onFoot, about.others);
  const put = (n: number, items: readonly Item[]): void =>
    onChange(
      items.length > 0 ? then.map((one, k) => (k === n ? items : one)) : then.filter((_, k) => k !== n),
    );
  const swap = (n: number): void => {
    const next = [...then];
    [next[n - 1], next[n]] = [nth(then, n), nth(then, n - 1)];
    onChange(next);
  };
  return (
    <>
      {then.map((items, n) => {
        const label = then.length > 1 ? t`Action ${n + 1}` : t`Action`;
        return (
          <section key={n} className="fold" aria-label={label}>
            {items.map((item, m) => (
              <ActionForm
                key={m}
                label={items.length > 1 ? t`${label}, part ${m + 1}` : label}
                item={item}
                onFoot={onFoot}
                onChange={(next) =>
                  put(
                    n,
                    items.map((one, k) => (k === m ? next : one)),
                  )
                }
                onRemove={
                  items.length > 1
                    ? () =>
                        put(
                          n,
                          items.filter((_, k) => k !== m),
                        )
                    : undefined
                }
                {...about}
              />
            ))}
            <Group justify="space-between" gap={6}>
              <Button
                size="compact-sm"
                variant="default"
                aria-label={t`Add parallel action to ${inSentence(label)}`}
                onClick={() => put(n, [...items, fresh()])}
              >
                <Trans>Add parallel action</Trans>
              </Button>
              {then.length > 1 && (
                <ListButtons
                  earlier={t`Move ${inSentence(label)} earlier`}
                  removal={t`Remove ${inSentence(label)}`}
                  first={n === 0}
                  only={false}
                  onEarlier={() => swap(n)}
                  onRemove={() => put(n, [])}
                />
              )}
            </Group>
          </section>
        );
      })}
      <Button size="compact-sm" variant="default" onClick={() => onChange([...then, [fresh()]])}>
        <Trans>Add next action</Trans>
      </Button>
    </>
  );
}

function ActionForm({
  label,
  item,
  onFoot,
  onChange,
  onRemove,
  ...about
}: About & {
  others: readonly string[];
  label: string;
  onFoot: boolean;
  item: Item;
  onChange: (item: Item) => void;
  onRemove?: () => void;
}) {
  const { others } = about;
  const known = actionKind(item.kind);
  return (
    <>
      <Select
        label={label}
        data={kindsFor(onFoot, item.kind)}
        value={item.kind}
        allowDeselect={false}
        onChange={(kind) => {
          if (kind && kind !== item.kind) onChange(newItem(kind, actionKind(kind), others));
        }}
      />
      {known?.fields.map((field) => (
        <FieldInput
          key={`${item.kind} ${field.is === "one" ? field.label : field.name}`}
          where={label}
          field={field}
          values={item.values}
          {...about}
          onChange={(values) => onChange({ ...item, values: settled(known, values, others) })}
        />
      ))}
      {onRemove && (
        <Button
          size="compact-sm"
          variant="default"
          aria-label={t`Remove ${inSentence(label)}`}
          onClick={onRemove}
        >
          <Trans>Remove</Trans>
        </Button>
      )}
    </>
  );
}
