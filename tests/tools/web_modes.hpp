#pragma once

#include <nlohmann/json.hpp>

namespace hairnet {

// Results of schema for hair in coefficients, which the web client must reproduce.

// `deviations` of several bases; `frames`: whole ones, what they decode to, and how many coefficients each prefix has
// (-1: refused); `spoilt`: bytes, and what they decode to, or null. `code`: which deviations.
nlohmann::ordered_json frame_code_cases();
// A small basis: its file, what it holds and the displacements of some coefficients; and files whose table is `spoilt`,
// with the checksum of what they hold, or null where they are refused.
nlohmann::ordered_json basis_cases();

}  // namespace hairnet
