import { vi } from "vitest";

/** What the page has sent: a path with its query, and JSON or a form. */
export interface Sent {
  path: string;
  body: unknown;
  request: Request;
}

/** Answers whatever the page asks the server, until globals are restored. */
export function stubFetch(answer: (sent: Sent) => Response | Promise<Response>): void {
  vi.stubGlobal("fetch", async (request: Request) => {
    const { pathname, search } = new URL(request.url);
    const type = request.headers.get("Content-Type") ?? "";
    let body: unknown;
    if (type.startsWith("application/json")) body = await request.json();
    else if (type.startsWith("multipart/form-data")) body = await request.formData();
    return answer({ path: pathname + search, body, request });
  });
}
