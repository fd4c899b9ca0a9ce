import { Alert, CloseButton, Stack } from "@mantine/core";
import { create } from "zustand";

import { reasonOf } from "./reason";

interface Notice {
  key: number;
  kind: "error" | "info";
  text: string;
}

interface Notices {
  list: Notice[];
  add: (kind: Notice["kind"], text: string) => void;
  close: (key: number) => void;
}

let last = 0;
const LONGEST = 9000;

export const useNotices = create<Notices>((set, get) => ({
  list: [],
  add: (kind, text) => {
    const key = ++last;
    set({ list: [...get().list.filter((one) => one.text !== text), { key, kind, text }].slice(-3) });
    setTimeout(() => get().close(key), LONGEST);
  },
  close: (key) => set({ list: get().list.filter((one) => one.key !== key) }),
}));

export const tell = (text: string): void => useNotices.getState().add("info", text);
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
            <CloseButton
              size="sm"
              variant="transparent"
              c="white"
              aria-label="Close this message"
              onClick={() => close(one.key)}
            />
          </div>
        </Alert>
      ))}
    </Stack>
  );
}
