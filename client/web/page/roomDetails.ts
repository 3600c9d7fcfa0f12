import type { Member, Transport } from "../src/index";
import { isolated } from "./isolated";

// What a room tells about its people, in words for people.

/** The built-in hairstyles by their names in `hairnet-groom make`. */
const kHairstyleNames: Readonly<Record<string, string>> = {
  long_straight: "Long straight hair",
  long_curly: "Long ringlets",
  wavy: "Waves",
  bob: "Bob",
  ponytail: "Ponytail",
  short: "Short hair",
};

/** The name of a hairstyle for people: "Long straight hair" for "long_straight". */
export function hairstyleName(name: string): string {
  const words = name.replaceAll(/[_-]+/g, " ").trim();
  return kHairstyleNames[name] ?? (isolated(words ? words[0].toUpperCase() + words.slice(1) : "") || "Hairstyle");
}

/** The name that a person gives, isolated; empty: none. */
export function givenName(member: Pick<Member, "tagText">): string {
  return isolated(member.tagText.replaceAll(/\s+/g, " ").trim());
}

/** The name of a person: the given one, or the hairstyle and a number. */
export function personName(member: Pick<Member, "tagText" | "groom" | "member" | "own">): string {
  const name = givenName(member) || `${hairstyleName(member.groom?.name ?? "")} ${member.member}`;
  return member.own ? `${name} (you)` : name;
}

/**
 * How the page talks with the server, in words. `transport` null: there is no connection now. `fallbackReason`: why it
 * is not WebTransport, or null where that was not tried.
 */
export function transportName(transport: Transport | null, fallbackReason: string | null): string {
  if (transport === null) return "no connection";
  if (transport === "webtransport") return "WebTransport";
  return fallbackReason === null ? "WebSocket" : `WebSocket (no WebTransport: ${fallbackReason})`;
}
