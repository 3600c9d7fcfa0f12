import { afterEach, describe, expect, test, vi } from "vitest";
import { connect, HairnetError } from "../../src/index";

/**
 * A platform on which every WebSocket fails as browsers report it: without a reason. `page`: the address of the page;
 * `answers`: the server answers other requests; `tellsClosed`: a failed socket also tells that it is closed. Returns
 * the requests.
 */
function stubPlatform(page: string, answers: boolean, tellsClosed = true): string[] {
  const asked: string[] = [];
  vi.stubGlobal("location", new URL(page));
  vi.stubGlobal("fetch", (url: string, { mode, credentials }: RequestInit) => {
    asked.push(`${String(mode)} ${String(credentials)} ${url}`);
    return answers ? Promise.resolve(new Response()) : Promise.reject(new TypeError("Failed to fetch"));
  });
  class FailingSocket {
    onclose: ((event: { code: number; reason: string }) => void) | null = null;
    onerror: (() => void) | null = null;
    constructor() {
      queueMicrotask(() => this.onerror?.());
      if (tellsClosed) queueMicrotask(() => this.onclose?.({ code: 1006, reason: "" }));
    }
    close(): void {}
  }
  vi.stubGlobal("WebSocket", FailingSocket);
  return asked;
}
const failureOf = async (server: string) => {
  const error: unknown = await connect(server).catch((thrown: unknown) => thrown);
  expect(error).toBeInstanceOf(HairnetError);
  return error as HairnetError;
};

// Browsers hide from a page why its WebSocket failed. The client asks the server's /healthz and tells from the answer
// which cause is likely, because the cures differ (connectionFailure.ts).
describe("a page's connection that fails", () => {
  afterEach(() => vi.unstubAllGlobals());

  test("at a server that refuses the page's origin says which flag allows it", async () => {
    const asked = stubPlatform("http://studio.example:5173/room", true);
    const { code, message } = await failureOf("ws://hair.example:7420");
    expect(code).toBe("origin_refused");
    expect(message).toBe(
      "the server at hair.example:7420 refuses pages from http://studio.example:5173: start it with --origins http://studio.example:5173",
    );
    // Without CORS the page cannot read the answer, and still learns that there is one. No cookies are sent.
    expect(asked).toEqual(["no-cors omit http://hair.example:7420/healthz"]);
  });

  test("where no server answers asks whether one is running", async () => {
    stubPlatform("http://localhost:5173/", false);
    const { code, message } = await failureOf("localhost:7420");
    expect(code).toBe("unreachable");
    expect(message).toBe("no server answers at localhost:7420: is hairnet-server running there?");
  });

  test("is known at once where the platform tells of an error and of no close, as Node does", async () => {
    stubPlatform("http://localhost:5173/", false, false);
    const { code, message } = await failureOf("ws://hair.example");
    expect(code).toBe("unreachable");
    expect(message).toBe("no server answers at hair.example:80: is hairnet-server running there?");
  });

  test("by TLS also names the certificate", async () => {
    const asked = stubPlatform("https://studio.example/", false);
    expect((await failureOf("wss://hair.example")).message).toMatch(
      /^no server answers at hair\.example:443: .* with a certificate that this browser trusts\?$/,
    );
    expect(asked[0]).toContain("https://hair.example/healthz");
  });

  // By default a server takes the pages that it hands out itself, so another cause is likely.
  test("at the page's own server blames no origin", async () => {
    stubPlatform("http://localhost:7420/", true);
    const { code, message } = await failureOf("http://localhost:7420");
    expect(code).toBe("unreachable");
    expect(message).toBe("the server at localhost:7420 answers, but opens no WebSocket at ws://localhost:7420/ws");
  });
});
