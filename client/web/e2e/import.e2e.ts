import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import type { Page } from "playwright-core";
import { makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { dropFiles } from "./dropFiles";
import { FileServer } from "./fileServer";
import { HairnetServer, program, until } from "./hairnetServer";
import { readyCount, shareWarm, takePicture, type PageGlobals } from "./picture";

const server = new HairnetServer();
const files = new FileServer();
const browser = new Browser();
const archive = exported("wavy", ".abc");

beforeAll(async () => {
  await server.start();
  await files.start();
  await browser.start();
});
afterEach(() => browser.closePages());
afterAll(async () => {
  await browser.dispose();
  await files.dispose();
  await server.dispose();
});

/** A hairstyle as a file of another program. */
function exported(style: string, extension: string): Uint8Array {
  const { path } = makeGroomFile(style);
  const out = path.replace(/\.groom$/, extension);
  execFileSync(program("hairnet-groom"), ["export", path, "--out", out]);
  return readFileSync(out);
}

/** The names and strands of the hairstyles that the page shows. */
function shownHair(page: Page): Promise<[name: string, strands: number][]> {
  return page.evaluate(() => {
    const { room } = (window as unknown as { hairnet: PageGlobals }).hairnet;
    return [...(room?.members.values() ?? [])].flatMap(({ groom }): [string, number][] =>
      groom ? [[groom.name, groom.strandCount]] : [],
    );
  });
}

const line = (page: Page) => page.textContent("#import-line");
const error = (page: Page) => page.textContent("#error");

// The page of a server reads the file itself, and uploads the groom that it has made.
test("an Alembic file that is dropped is worn, and another page sees it", async () => {
  const page = await browser.open(`${server.address}/?room=import`);
  const second = await browser.open(`${server.address}/?room=import&observe`);
  await dropFiles(page, ["my curls.abc", archive]);
  await until("a line says how the hair was taken to lie", async () =>
    /^my curls\.abc: taken as up \+y, face \+z, 1 m a unit, roots first$/.test((await line(page)) ?? ""),
  );
  expect(await page.textContent("#import-remarks")).toContain("my curls.abc: Alembic");
  for (const one of [page, second]) {
    await until("it is ready", async () => (await readyCount(one)) === 1, 90_000);
    expect(await shownHair(one)).toEqual([["my curls", 300]]);
  }
  // Hair and skin cover some hundredths of the picture, and the empty backdrop has no such colours.
  await until("it is in the picture", async () => shareWarm(await takePicture(second)) > 0.03);
  expect(await page.locator("#hairstyle option:checked").textContent()).toBe("My curls");
  expect(browser.takeErrors()).toEqual([]);
});

test("a file that cannot be read is told in one line, and the hair that is worn stays", async () => {
  const page = await browser.open(`${server.address}/?room=broken`);
  await page.setInputFiles("#groom-file", { name: "curls.abc", mimeType: "", buffer: Buffer.from(archive) });
  await until("it is ready", async () => (await readyCount(page)) === 1, 90_000);
  // Half an Alembic file is a download that broke off. A picture is no hair, whatever bytes it has.
  await dropFiles(page, ["half.abc", archive.subarray(0, archive.length / 2)]);
  await until("a line says what is wrong", async () => /^half\.abc: [^\n]+$/.test((await error(page)) ?? ""));
  await dropFiles(page, ["photo.png", archive]);
  await until("a line says what can be read", async () => /^photo\.png: .*\.abc/.test((await error(page)) ?? ""));
  expect(await readyCount(page)).toBe(1);
  expect(await page.isVisible("#import-line")).toBe(false);
  expect(browser.takeErrors()).toEqual([]);
});

test("without a server its levels are built in the page", async () => {
  const page = await browser.open(files.address);
  await until("the page's own hair is there", async () => (await readyCount(page)) === 1);
  await dropFiles(page, ["curls.usda", exported("bob", ".usda")]);
  await until("it is worn", async () => String(await shownHair(page)) === "curls,300");
  await until("its hair can move", () =>
    page.evaluate(() => {
      const { room } = (window as unknown as { hairnet: PageGlobals }).hairnet;
      return [...(room?.members.values() ?? [])].some(({ lattice }) => lattice !== null);
    }),
  );
  expect(browser.takeErrors()).toEqual([]);
});
