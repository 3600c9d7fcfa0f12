import { mkdirSync } from "node:fs";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { PageViewer } from "../page/viewer";
import { makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { FileServer } from "./fileServer";
import { Firefox } from "./firefox";
import { until } from "./hairnetServer";
import { readyCount, shareChanged, shareWarm, takePicture } from "./picture";

interface Globals {
  hairnet: PageViewer;
}

const files = new FileServer();
const browser = new Browser();
const firefox = new Firefox();
const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  await files.start();
  await browser.start();
});
afterAll(async () => {
  await browser.dispose();
  await firefox.dispose();
  await files.dispose();
});

/** Runs in the page. Returns the largest displacement of the own hair from rest, m, or -1 while it is rigid. */
function hairIsAway(): number {
  const own = (window as unknown as Partial<Globals>).hairnet?.own?.member;
  return own?.lattice ? own.lattice.grid.reduce((most, x) => Math.max(most, Math.abs(x)), 0) : -1;
}

test("without a server hair is drawn and follows the head, wind and look; nothing is asked of others", async () => {
  const page = await browser.open("about:blank");
  const away = () => page.evaluate(hairIsAway);
  const asked: string[] = [];
  page.on("request", (request) => asked.push(request.url()));
  page.on("websocket", (socket) => asked.push(socket.url()));
  await page.goto(files.address);
  await until("the own head is ready", async () => (await readyCount(page)) === 1);
  await page.selectOption("#quality", "0.3");
  await until("it is in the picture", async () => shareWarm(await takePicture(page)) > 0.03);
  await until("hair can move", async () => (await away()) >= 0);
  expect(await page.textContent("#state")).toBe("no server");
  expect(await page.textContent("#play")).toContain("this browser alone simulates the hair");

  // The limits: within 1 mm the hair is at rest, and more than 4 mm are a swing that a picture shows.
  await until("hair lies at rest", async () => (await away()) < 0.001);
  const rest = await takePicture(page);
  await page.focus("#view");
  await page.keyboard.down("ArrowLeft");
  await until("hair swings", async () => (await away()) > 0.004);
  await page.keyboard.up("ArrowLeft");
  await until("the picture is another one", async () => shareChanged(await takePicture(page), rest) > 0.01);
  await page.screenshot({ path: `${shots}/local.png`, timeout: 90_000 });

  await page.getByRole("button", { name: "Hurricane", exact: true }).click();
  await until("hair flies", async () => (await away()) > 0.02);
  await page.getByRole("button", { name: "Calm", exact: true }).click();
  // The preset Hurricane moves nodes by more than 2 cm. Afterwards the hair needs time for the last millimetres.
  await until("hair hangs again", async () => (await away()) < 0.003);

  // A hairstyle without a file of levels: the page builds them.
  await page.setInputFiles("#groom-file", makeGroomFile("short").path);
  await until("it is rigid until then", async () => (await away()) < 0);
  await until("its levels are built", async () => (await away()) >= 0);
  // The page must ask no other server for anything. It loads the module that simulates, and not the one for a server.
  expect(asked.filter((address) => !/^(blob|data):/.test(address) && !address.startsWith(files.address))).toEqual([]);
  expect(asked.some((address) => address.includes("hairnet_local"))).toBe(true);
  expect(asked.some((address) => /hairnet-[0-9a-f]+\.wasm/.test(address))).toBe(false);
  expect(browser.takeErrors()).toEqual([]);
});

test("so it does in Firefox", async () => {
  await firefox.start();
  const page = await firefox.open(files.address);
  const away = () => page.evaluate(hairIsAway);
  await until("the own hair is there", async () => (await away()) >= 0);
  await until("it lies at rest", async () => (await away()) < 0.001);
  await page.focus("#view");
  await page.keyboard.down("ArrowLeft");
  await until("it swings", async () => (await away()) > 0.004);
  await page.keyboard.up("ArrowLeft");
});
