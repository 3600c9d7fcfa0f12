import { expect, test } from "vitest";
import { GroomFetch } from "../../src/net/groomFetch";
import { hashGroom } from "../../src/net/groomHash";

const file = new Uint8Array(1000).map((_, n) => n);
const second = new Uint8Array(500).map((_, n) => 3 * n);

function piece(bytes: Uint8Array, offset: number, end: number) {
  return {
    type: "groomData" as const,
    hash: hashGroom(bytes),
    offset,
    byteCount: bytes.length,
    bytes: bytes.subarray(offset, end),
  };
}

test("tells the bytes that have arrived of the files whose size is known", () => {
  const fetch = new GroomFetch();
  expect(fetch.downloads).toEqual({ bytes: 0, byteCount: 0 });
  fetch.request(hashGroom(file));
  fetch.request(hashGroom(second));
  expect(fetch.downloads).toEqual({ bytes: 0, byteCount: 0 });
  fetch.take(piece(file, 0, 400));
  expect(fetch.downloads).toEqual({ bytes: 400, byteCount: 1000 });
  expect(fetch.take(piece(file, 400, 1000))?.fault).toBe("");
  fetch.take(piece(second, 0, 100));
  expect(fetch.downloads).toEqual({ bytes: 1100, byteCount: 1500 });
  fetch.refuse(hashGroom(second));
  expect(fetch.downloads).toEqual({ bytes: 1000, byteCount: 1000 });
});

test("counts again when nothing was on its way", () => {
  const fetch = new GroomFetch();
  fetch.request(hashGroom(file));
  fetch.take(piece(file, 0, 1000));
  fetch.request(hashGroom(second));
  fetch.take(piece(second, 0, 200));
  expect(fetch.downloads).toEqual({ bytes: 200, byteCount: 500 });
});

test("takes what is new of pieces that come again, and none beyond a gap", () => {
  const fetch = new GroomFetch();
  fetch.request(hashGroom(file));
  for (const [begin, end] of [
    [0, 400],
    [0, 300],
    [200, 700],
  ])
    expect(fetch.take(piece(file, begin, end))).toBeNull();
  expect(fetch.downloads.bytes).toBe(700);
  expect(fetch.take(piece(file, 700, 1000))?.bytes).toEqual(file);
  fetch.request(hashGroom(file));
  expect(fetch.take(piece(file, 1, 300))?.fault).toMatch(/fit together/);
});
