import { expect, test } from "vitest";
import { closedWords, foreignFileWords, refusedWords } from "../../page/errorWords";
import { fileHairstyle } from "../../page/hairstyles";
import { loadingWords } from "../../page/loadingLine";
import { hairstyleName } from "../../page/roomDetails";
import { HairnetError } from "../../src/index";
import { objText } from "../support/objText";

test("a server that does not answer is named with its address and the next attempt", () => {
  // The last argument is the time until the next attempt, s. The page rounds it up.
  const words = closedWords("ws://127.0.0.1:9/ws", "no WebSocket at ws://127.0.0.1:9/ws", 1.6);
  expect(words).toBe("The server does not answer at 127.0.0.1:9. The page tries again in 2 s.");
  expect(closedWords("https://hair.example", "", 1)).toContain("at hair.example.");
  expect(closedWords("http://x", "the server says goodbye: draining for an update", 3)).toBe(
    "The server ended the connection: Draining for an update. The page tries again in 3 s.",
  );
});

test("each refusal of a token says what is wrong and whom to ask", () => {
  // A server's refusal is a short reason such as "wrong_room", or a whole line. `hasToken`: the page's address has a
  // token.
  const refused = (error: string, hasToken = true) => refusedWords(`the server says goodbye: ${error}`, hasToken);
  expect(refused("malformed", false)).toMatch(/^This room needs a token\. Ask /);
  expect(refused("this room needs a token; ask the operator for one", false)).toMatch(
    /^This room needs a token\. Ask /,
  );
  expect(refused("expired")).toMatch(/^The token in this address has expired\. Ask /);
  expect(refused("the token expired at 2026-01-02 03:04 UTC")).toMatch(
    /^The token expired at 2026-01-02 03:04 UTC\. Ask /,
  );
  expect(refused("wrong_room")).toMatch(/^The token in this address is for another room\. Ask /);
  expect(refused("the token is for the room hall")).toMatch(/^The token is for the room hall\. Ask /);
  expect(refused("malformed")).toMatch(/^The token in this address is not valid\. Ask /);
  for (const error of ["malformed", "expired", "wrong_room"]) expect(refused(error)).not.toMatch(/_|goodbye|malformed/);
});

test("other refusals are the server's own line", () => {
  expect(refusedWords("the server says goodbye: removed by a moderator: spam", true)).toBe(
    "Removed by a moderator: spam.",
  );
  expect(refusedWords("a room's name is up to 64 letters, digits and . _ -", false)).toBe(
    "A room's name is up to 64 letters, digits and . _ -.",
  );
  expect(refusedWords("the server says goodbye: ", true)).toBe("The server gave no reason.");
});

test("files that make no hairstyle are named, with what helps", async () => {
  expect(foreignFileWords(["curls.abc", "scene.FBX"], "…")).toMatch(/does not read scene\.FBX: export .* as \.abc/);
  const refusal = async (...files: [name: string, text: string][]) => {
    const given = files.map(([name, text]) => ({ name, arrayBuffer: () => new Blob([text]).arrayBuffer() }));
    const error = await fileHairstyle(given).catch((thrown: unknown) => thrown);
    expect(error).toBeInstanceOf(HairnetError);
    expect((error as HairnetError).message).not.toContain("\n");
    return (error as HairnetError).message;
  };
  expect(await refusal(["braid.hair", "HAIR"])).toMatch(/^braid\.hair: /);
  expect(await refusal(["photo.png", "PNG"])).toMatch(/^photo\.png: strands are read from .*\.abc/);
  // The importer's line names its flag --unit, which the page does not have.
  expect(await refusal(["one.obj", "v 0 0 0\nv 0 1 0\nl 1 2\n"])).toMatch(/--unit \(flags of hairnet-groom import/);
  expect(await refusal(["licence.groom", "MIT Licence"])).toMatch(/^licence\.groom is no whole hairstyle file: /);
  expect(await refusal(["a.groom", ""], ["b.abc", ""])).toMatch(/^a\.groom is a whole hairstyle: give it without/);
});

test("files of another program make a hairstyle with their name, and lines that say what was guessed", async () => {
  const file = { name: "my_curls.obj", arrayBuffer: () => new Blob([objText()]).arrayBuffer() };
  const { style, remarks } = await fileHairstyle([file]);
  expect(style.label).toBe("My curls");
  expect(remarks[0]).toMatch(/^my_curls\.obj: taken as up \+y, face /);
});

test("the loading line says what the page waits for, with bytes", () => {
  const downloads = { bytes: 1_234_000, byteCount: 2_400_000 };
  // Of three people one has a groom, and no hair can be drawn yet. The first step that is missing is named.
  const waiting = { isConnected: true, people: 3, withGroom: 1, ready: 0, downloads, building: null };
  expect(loadingWords({ ...waiting, isConnected: false })?.text).toBe("Connecting to the room");
  expect(loadingWords(waiting)).toEqual({
    text: "Downloading hairstyles: 1.2 of 2.4 MB",
    share: 1_234_000 / 2_400_000,
  });
  expect(loadingWords({ ...waiting, downloads: { bytes: 0, byteCount: 0 } })).toEqual({
    text: "Downloading hairstyles",
    share: null,
  });
  expect(loadingWords({ ...waiting, withGroom: 3, ready: 1 })?.text).toBe("Preparing hair: 1 of 3 heads");
  expect(loadingWords({ ...waiting, withGroom: 3, ready: 3 })).toBeNull();
  expect(loadingWords({ ...waiting, people: 0, withGroom: 0 })).toBeNull();
  expect(loadingWords({ ...waiting, withGroom: 3, ready: 3, building: 0.4 })?.share).toBe(0.4);
});

test("hairstyles have names for people", () => {
  expect(hairstyleName("long_straight")).toBe("Long straight hair");
  expect(hairstyleName("my_new-style")).toBe("My new style");
  expect(hairstyleName("")).toBe("Hairstyle");
});
