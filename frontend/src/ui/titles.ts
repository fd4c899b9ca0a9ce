import { useEffect } from "react";
import { create } from "zustand";

/** Names of scenarios as their documents have them, by the names of their files. */
const useKnown = create<{ titles: Readonly<Record<string, string>> }>(() => ({ titles: {} }));

/** What a scenario is called: its name in the document, or else that of its file. */
export const useTitle = (scenario: string): string => {
  const title = useKnown(({ titles }) => titles[scenario]);
  return title?.trim() ? title : scenario;
};

export const learnTitle = (scenario: string, title: string): void =>
  useKnown.setState(({ titles }) =>
    titles[scenario] === title ? { titles } : { titles: { ...titles, [scenario]: title } },
  );

/** Lets the head of the page know what the scenario that is open is called. */
export function useLearnedTitle(scenario: string, title: string | undefined): void {
  useEffect(() => {
    if (title !== undefined) learnTitle(scenario, title);
  }, [scenario, title]);
}
