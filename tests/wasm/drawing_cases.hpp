#pragma once

#include <string>

namespace hairnet::same_bits {

// What client/draw makes of sizes, boxes, cameras and a character, for the renderer in TypeScript, which does the same
// for three.js: a line each, of a word and numbers, those that go in before those that come out.
std::string drawing_cases();

}  // namespace hairnet::same_bits
