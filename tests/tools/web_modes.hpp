#pragma once

#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>

#include "schema/wire/basis_file.hpp"
#include "tests/tools/web_random.hpp"

namespace hairnet {

// Results of schema and link for hair in coefficients, which the web client must reproduce.

// Of any modes, on a lattice of `dims`.
wire::HairBasis make_basis(WebRandom& random, const std::array<int, 3>& dims, std::size_t mode_count);

// `deviations` of several bases; `frames`: whole ones, what they decode to, and how many coefficients each prefix has
// (-1: refused); `spoilt`: bytes, and what they decode to, or null. `code`: which deviations.
nlohmann::ordered_json frame_code_cases();
// A small basis: its file, what it holds and the displacements of some coefficients; and files whose table is `spoilt`,
// with the checksum of what they hold, or null where they are refused.
nlohmann::ordered_json basis_cases();
// Frames of one character: `file` of its basis, `contents`, the `coefficients` that they have, 33 ms from each to the
// next; and the hair `state` that an owner's client has after the last.
nlohmann::ordered_json sequence_case();

}  // namespace hairnet
