import { i18n } from "@lingui/core";
import { I18nProvider } from "@lingui/react";
import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen, within } from "@testing-library/react";
import userEvent, { type UserEvent } from "@testing-library/user-event";
import type { ReactNode } from "react";
import { afterEach, vi } from "vitest";

import { theme } from "../src/ui/theme";
import { stubFetch } from "./requests";

afterEach(() => {
  cleanup();
  sessionStorage.clear();
  vi.unstubAllGlobals();
});

/** Shows a part of the page to a user; the answer shows another state of it in its place. */
export function show(part: ReactNode): { user: UserEvent; again: (part: ReactNode) => void } {
  const whole = (inner: ReactNode) => (
    <I18nProvider i18n={i18n}>
      <MantineProvider theme={theme()} env="test">
        {inner}
      </MantineProvider>
    </I18nProvider>
  );
  const { rerender } = render(whole(part));
  return { user: userEvent.setup(), again: (next) => rerender(whole(next)) };
}

/** Chooses from the list with this label. */
export async function choose(user: UserEvent, label: string, option: string): Promise<void> {
  await user.click(screen.getByRole("textbox", { name: label }));
  await user.click(screen.getByRole("option", { name: option }));
}

/** Replaces what is in a field and leaves it. */
export async function fill(user: UserEvent, label: string, text: string): Promise<void> {
  const field = screen.getByRole("textbox", { name: label });
  await user.clear(field);
  if (text) await user.type(field, text);
  await user.tab();
}

/** Answers of the server by path, as long as it is asked; what was asked is kept. */
export function server(answers: Record<string, unknown>): { path: string; body: unknown }[] {
  const asked: { path: string; body: unknown }[] = [];
  stubFetch(({ path, body }) => {
    asked.push({ path, body });
    const found = Object.keys(answers).find((key) => path.includes(key));
    const answer = found === undefined ? undefined : answers[found];
    return answer === undefined
      ? new Response(JSON.stringify({ error: { kind: "NotFound", message: `nothing at ${path}` } }), {
          status: 404,
        })
      : new Response(JSON.stringify(answer));
  });
  return asked;
}

/** The texts of the cells of each row of a table, below its head. */
export const rowsOf = (table: HTMLElement): string[][] =>
  within(table)
    .getAllByRole("row")
    .slice(1)
    .map((row) => [...row.children].map((cell) => cell.textContent ?? ""));
