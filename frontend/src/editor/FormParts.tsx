import { ActionIcon, Button, type ButtonProps, Group, TextInput, Tooltip } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { IconTrash } from "../ui/icons";
import { type PickBy, type Picked, type PlacePick, useTaking } from "./pick";

/** Opens the form of a part, and shows on the map where it is. */
export function OpenAndShow({
  part,
  open,
  onOpen,
  onShow,
}: {
  part: string;
  open: boolean;
  onOpen: () => void;
  onShow: () => void;
}) {
  return (
    <Group gap={6}>
      <Button
        size="compact-sm"
        variant="default"
        aria-expanded={open}
        aria-label={`${open ? t`Done` : t`Change`} ${part}`}
        onClick={onOpen}
      >
        {open ? t`Done` : t`Change`}
      </Button>
      <Button size="compact-sm" variant="default" aria-label={t`Show where ${part} is`} onClick={onShow}>
        <Trans>Show where</Trans>
      </Button>
    </Group>
  );
}

/** A text that is sent when it is finished, not with every key. */
export function CommittedText({
  label,
  value,
  placeholder,
  maxLength,
  onCommit,
}: {
  label: string;
  value: string;
  placeholder?: string;
  maxLength?: number;
  onCommit: (text: string) => void;
}) {
  const commit = (text: string): void => {
    if (text.trim() !== value) onCommit(text.trim());
  };
  return (
    <TextInput
      key={value}
      label={label}
      defaultValue={value}
      placeholder={placeholder}
      maxLength={maxLength}
      onBlur={(event) => commit(event.currentTarget.value)}
      onKeyDown={(event) => {
        if (event.key === "Enter") commit(event.currentTarget.value);
      }}
    />
  );
}

/** Lets places be chosen on the map for a form, until one was taken or for as long as it is wanted. */
export function PickButton({
  pick,
  pickKey,
  by,
  onTake,
  many = false,
  name,
  children,
  ...rest
}: Pick<ButtonProps, "style" | "disabled"> & {
  pick: PlacePick;
  /** Which form and field this is. */
  pickKey: string;
  by: PickBy;
  onTake: (picked: Picked) => void;
  /** Whether more are taken after the first. */
  many?: boolean;
  /** What it is called where the text alone does not say. */
  name?: string;
  children: string;
}) {
  const taking = useTaking(pick, pickKey, (picked) => {
    onTake(picked);
    if (!many) pick.stop();
  });
  const active = taking && pick.now?.by === by;
  return (
    <Button
      size="compact-sm"
      variant={active ? "filled" : "default"}
      aria-pressed={active}
      aria-label={active ? t`Stop choosing` : name}
      onClick={() => (active ? pick.stop() : pick.start(pickKey, by))}
      {...rest}
    >
      {active ? t`Stop choosing` : children}
    </Button>
  );
}

/** Moves one of a list towards its begin, and takes it out. */
export function ListButtons({
  earlier,
  removal,
  first,
  only,
  onEarlier,
  onRemove,
}: {
  /** What the two buttons do, as names. */
  earlier: string;
  removal: string;
  first: boolean;
  only: boolean;
  onEarlier: () => void;
  onRemove: () => void;
}) {
  return (
    <Group gap={6} wrap="nowrap" style={{ flexShrink: 0 }}>
      <Tooltip label={t`Earlier in the order`}>
        <ActionIcon variant="default" size="lg" disabled={first} aria-label={earlier} onClick={onEarlier}>
          <span aria-hidden="true">↑</span>
        </ActionIcon>
      </Tooltip>
      <ActionIcon
        variant="subtle"
        color="gray"
        size="lg"
        disabled={only}
        aria-label={removal}
        onClick={onRemove}
      >
        <IconTrash />
      </ActionIcon>
    </Group>
  );
}
