// Letters that are written from right to left, and characters that direct the text around them.
const kDirects =
  /[\u0590-\u08ff\u200e\u200f\u202a-\u202e\u2066-\u2069\ufb1d-\ufdff\ufe70-\ufefc\u{10800}-\u{10fff}\u{1e800}-\u{1efff}]/u;
/** Characters that direct the text after them until they are ended: embeddings, overrides and isolates of Unicode. */
const kEmbeddings = /[\u202a-\u202e\u2066-\u2069]/g;
// Text between these two has the direction of its first letter and does not influence the text around it.
const kFirstStrongIsolate = "\u2068";
const kPopIsolate = "\u2069";

/**
 * A foreign text, such as a person's name, that leaves the text around it in order: it has a direction of its own, and
 * loses the characters that would direct more than it.
 */
export function isolated(text: string): string {
  if (!kDirects.test(text)) return text;
  const plain = text.replace(kEmbeddings, "");
  return plain === "" ? "" : kFirstStrongIsolate + plain + kPopIsolate;
}
