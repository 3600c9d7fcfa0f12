import { createServer, type AddressInfo } from "node:net";
import { chromium } from "playwright-core";
import type { TestProject } from "vitest/node";

declare module "vitest" {
  interface ProvidedContext {
    /** The endpoint at which a test connects to Chromium. */
    chromium: string;
    /** Chromium finds the server of the examples' pages, localhost:7420, on this port: another one may have theirs. */
    examplePort: number;
  }
}

/** A port that is free now. */
export async function freePort(): Promise<number> {
  const probe = createServer();
  await new Promise<void>((done) => probe.listen(0, "127.0.0.1", done));
  const { port } = probe.address() as AddressInfo;
  await new Promise((done) => probe.close(done));
  return port;
}

/**
 * Starts what all test files share: Chromium, which draws in software: pictures are few and slow, but correct. It draws
 * with Mesa, which compiles shaders to quicker programs than Chromium's own SwiftShader and keeps them on the disk.
 */
export default async function start(project: TestProject): Promise<() => Promise<void>> {
  const examplePort = await freePort();
  const server = await chromium.launchServer({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    // The flag --headless=new below selects the newer headless mode instead.
    headless: false,
    env: { ...process.env, LIBGL_ALWAYS_SOFTWARE: "1", EGL_PLATFORM: "surfaceless" },
    args: [
      "--headless=new",
      "--no-sandbox",
      "--use-gl=angle",
      "--use-angle=gl-egl",
      "--ignore-gpu-blocklist",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
      "--disable-background-timer-throttling",
      "--disable-renderer-backgrounding",
      "--disable-backgrounding-occluded-windows",
      `--host-resolver-rules=MAP localhost:7420 127.0.0.1:${examplePort}`,
      // A busy machine takes longer for a picture than the watchdog allows for.
      "--disable-gpu-watchdog",
    ],
  });
  project.provide("chromium", server.wsEndpoint());
  project.provide("examplePort", examplePort);
  return () => server.close();
}
