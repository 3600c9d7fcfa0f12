import type { ErrorCode } from "../module/hairnetError";
import { hostAndPort } from "./url";

/** A server that does not answer within this time counts as none. */
const kProbeMs = 2000;

/** Why a WebSocket could not be opened, in one line with the cure. */
export interface ConnectionFailure {
  readonly code: ErrorCode;
  readonly detail: string;
}

/**
 * Finds out why a page's WebSocket to `url` failed. Browsers hide the server's answer from the page. A request without
 * CORS tells whether any server answers at that address, and nothing else. Never rejects.
 */
export async function explainFailure(url: string): Promise<ConnectionFailure> {
  const { host, protocol } = new URL(url);
  const page = typeof location === "undefined" ? null : location;
  if (!(await answers(`${protocol === "wss:" ? "https" : "http"}://${host}/healthz`))) {
    const trusted = protocol === "wss:" ? ", with a certificate that this browser trusts" : "";
    return {
      code: "unreachable",
      detail: `no server answers at ${hostAndPort(url)}: is hairnet-server running there${trusted}?`,
    };
  }
  if (!page || page.host === host)
    return { code: "unreachable", detail: `the server at ${host} answers, but opens no WebSocket at ${url}` };
  const detail = `the server at ${host} refuses pages from ${page.origin}: start it with --origins ${page.origin}`;
  return { code: "origin_refused", detail };
}

/** Whether anything answers at this address, whatever it says: without CORS the page cannot read it. */
async function answers(url: string): Promise<boolean> {
  try {
    const signal = AbortSignal.timeout(kProbeMs);
    await fetch(url, { mode: "no-cors", cache: "no-store", credentials: "omit", signal });
    return true;
  } catch {
    return false;
  }
}
