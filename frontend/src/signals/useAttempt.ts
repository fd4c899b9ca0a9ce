import { useState } from "react";

import type { Edit } from "../api/types";
import type { SignalEditing } from "./editing";

/** What a form asks for, and why the last of it was refused. */
export interface Attempt {
  refused: string | null;
  /** Answers whether it was done. */
  ask: (edits: readonly Edit[], label?: string) => Promise<boolean>;
  /** Says something without asking; null takes back what was said. */
  say: (refused: string | null) => void;
}

/** Changes whose refusal is shown at the field that asked for them. */
export function useAttempt({ attempt }: SignalEditing): Attempt {
  const [refused, say] = useState<string | null>(null);
  return {
    refused,
    say,
    ask: async (edits, label) => {
      const reason = await attempt(edits, label);
      say(reason);
      return reason === null;
    },
  };
}
