export const EditorView = (_: { scenario: string }) => null;
