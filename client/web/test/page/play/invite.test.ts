import { expect, test } from "vitest";
import { inviteLink, inviteNote } from "../../../page/play/invite";
import { readQuery } from "../../../page/query";

const invite = (address: string) => {
  const page = new URL(address);
  const link = inviteLink(page, readQuery(page));
  return { link: link.href, note: inviteNote(link, readQuery(page)) };
};

// Anyone who has the link may pass it on, so it must not carry the user's own token.
test("a link leads to the same room and server, and gives away no token", () => {
  expect(invite("https://hair.example/?room=hall&token=secret&observe").link).toBe("https://hair.example/?room=hall");
  expect(invite("https://hair.example/").link).toBe("https://hair.example/");
  expect(invite("https://page.example/hair/?server=wss://far.example:7420").link).toBe(
    "https://page.example/hair/?server=wss%3A%2F%2Ffar.example%3A7420",
  );
});

test("it says when the link works here only, or needs a token", () => {
  // A loopback address works on this machine alone; --bind is the server's flag that lets others in.
  expect(invite("http://localhost:7420/").note).toContain("--bind");
  expect(invite("http://127.0.0.1:7420/").note).toContain("--bind");
  expect(invite("https://hair.example/?token=secret").note).toContain("token");
  expect(invite("https://hair.example/").note).toBe("");
});
