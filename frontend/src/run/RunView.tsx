export const RunView = (_: { scenario: string; run: string }) => null;
