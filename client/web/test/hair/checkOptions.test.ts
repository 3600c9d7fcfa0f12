import { describe, expect, test } from "vitest";
import { checkOptions } from "../../src/hair/checkOptions";
import { HairnetError } from "../../src/module/hairnetError";

const known = { room: true, token: true, clientName: true, reconnect: true };
const errorOf = (options: unknown): HairnetError | null => {
  try {
    checkOptions(options as Partial<typeof known>, known, "connect");
    return null;
  } catch (error) {
    return error as HairnetError;
  }
};

describe("options", () => {
  test("that exist, or none, are taken", () => {
    for (const good of [{}, { room: true }, { room: true, token: true }]) expect(errorOf(good)).toBeNull();
  });

  // Names within a third of their letters count as misspelt (`nearest` of checkOptions.ts), whatever their capitals.
  test("that are misspelt are refused, and the message names the likely one", () => {
    for (const [wrong, meant] of [
      ["rooom", "room"],
      ["Room", "room"],
      ["rom", "room"],
      ["tokens", "token"],
      ["clientname", "clientName"],
      ["reconect", "reconnect"],
    ]) {
      const error = errorOf({ [wrong]: 1 });
      expect(error).toBeInstanceOf(HairnetError);
      expect(error?.code).toBe("unknown_option");
      expect(error?.message).toBe(`connect: there is no option '${wrong}'; did you mean '${meant}'?`);
    }
  });

  test("that are like no other are refused with the list", () => {
    const message = "connect: there is no option 'colour'; there are room, token, clientName, reconnect";
    expect(errorOf({ colour: 1 })?.message).toBe(message);
    // Every object has a toString, so a look-up in the list of options would find this name.
    expect(errorOf({ toString: 1 })?.code).toBe("unknown_option");
  });

  test("that are no object are refused", () => {
    for (const bad of [null, undefined, "hall", 3, ["hall"]]) {
      expect(errorOf(bad)?.code).toBe("invalid");
      expect(errorOf(bad)?.message).toBe("connect: options are an object like { room: ... }");
    }
  });
});
