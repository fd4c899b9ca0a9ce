import { Alert, Button, CloseButton, Stack } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { create } from "zustand";

import { reasonOf } from "./reason";

/** What can be done about a notice. */
interface Action {
  label: string;
  run: () => void;
}

interface Notice {
  key: number;
  kind: "error" | "info";
  text: string;
  action: Action | undefined;
}

interface Notices {
  list: Notice[];
  add: (kind: Notice["kind"], text: string, action?: Action) => void;
  close: (key: number) => void;
}

let last = 0;
const LONGEST = 9000;
/** Time enough to think again, and to reach the button without a mouse. */
const LONGEST_ACTION = 20_000;

export const useNotices = create<Notices>((set, get) => ({
  list: [],
  add: (kind, text, action) => {
    const key = ++last;
    set({ list: [...get().list.filter((one) => one.text !== text), { key, kind, text, action }].slice(-3) });
    setTimeout(() => get().close(key), action ? LONGEST_ACTION : LONGEST);
  },
  close: (key) => set({ list: get().list.filter((one) => one.key !== key) }),
}));

export const tell = (text: string, action?: Action): void => useNotices.getState().add("info", text, action);
export function tellError(error: unknown): void {
  useNotices.getState().add("error", reasonOf(error));
}

/** What the program has to say, at the foot of the page and read aloud. */
export function NoticeList() {
  const { list, close } = useNotices();
  return (
    <Stack className="notices" gap="xs" role="status" aria-live="polite">
      {list.map((one) => (
        <Alert key={one.key} color={one.kind === "error" ? "red" : "blue"} variant="filled" py="xs" pr="xs">
          <div className="notice">
            <span>{one.text}</span>
            {one.action && (
              <Button
                size="compact-sm"
                variant="white"
                style={{ flexShrink: 0 }}
                onClick={() => {
                  one.action?.run();
                  close(one.key);
                }}
              >
                {one.action.label}
              </Button>
            )}
            <CloseButton
              size="sm"
              variant="transparent"
              c="white"
              aria-label={t`Close this message`}
              onClick={() => close(one.key)}
            />
          </div>
        </Alert>
      ))}
    </Stack>
  );
}
