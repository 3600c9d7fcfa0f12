import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { expect, test } from "vitest";

// e2e/examples.e2e.ts runs the minimal example against a server.
test.each(["README.md", "../../README.md"])("the program on %s is the minimal example", (page) => {
  const [, block] = /^```ts\n(.*?)^```$/ms.exec(readFileSync(resolve(page), "utf8"))!;
  expect(block).toBe(readFileSync(resolve("examples/minimal/main.ts"), "utf8"));
});
