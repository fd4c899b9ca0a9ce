import { served } from "../language/served";

/** Why something failed, in the words of the reader. */
export const reasonOf = (error: unknown): string =>
  error instanceof Error ? served(error.message) : String(error);
