import { expect } from "vitest";
import { HairnetError } from "../../src/index";

/** The error of a call: a `HairnetError` of one line. */
export function errorOf(call: () => unknown): HairnetError {
  try {
    call();
  } catch (error) {
    expect(error).toBeInstanceOf(HairnetError);
    expect((error as HairnetError).message).not.toContain("\n");
    return error as HairnetError;
  }
  throw new Error("nothing was thrown");
}
