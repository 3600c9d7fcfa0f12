// The lines of class Results (results.hpp).

/** A name, the number of elements of `size` bytes, and their hash (FNV-1a). */
export function lineOf(name, size, bytes) {
  let hash = 0xcbf29ce484222325n;
  for (const byte of bytes) hash = BigInt.asUintN(64, (hash ^ BigInt(byte)) * 0x100000001b3n);
  return `${name} ${bytes.length / size} ${hash.toString(16).padStart(16, "0")}`;
}

// Lines that begin with "~" have a bound there, by which their numbers may differ.
function isNear(a, b) {
  const left = a.split(" "), right = b.split(" "), bound = Number(a.slice(1, a.indexOf(" ")));
  return (
    a[0] === "~" &&
    left.length === right.length &&
    left.every((word, i) => word === right[i] || Math.abs(word - right[i]) <= bound)
  );
}

/** Ends the program: with 0 if all lines are as expected, otherwise it prints those that are not. */
export function compare(got, expected) {
  const wanted = expected.trimEnd().split("\n");
  const wrong = wanted.filter((line, i) => line !== got[i] && !isNear(line, got[i] ?? ""));
  for (const line of wrong) console.log(`differs: ${line.slice(0, 200)}`);
  console.log(`${wanted.length} results, ${wrong.length} differ`);
  process.exit(wrong.length === 0 && got.length === wanted.length ? 0 : 1);
}
