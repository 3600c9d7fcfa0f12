#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/modes/basis.hpp"
#include "core/result.hpp"
#include "core/skin/skin_distance_field.hpp"

namespace hairnet::wire {

// What a client needs to draw the hair of a groom from coefficients: the finest level's lattice and its modes, and the
// skin to keep it out of.
struct HairBasis {
  LevelGeometry geometry;
  Basis basis;
  // The skin, whose distances are those that their bytes in the file stand for (skin_byte).
  Skin skin;
};

// A file, which clients download by its hash as they do grooms. Deterministic for one version of zlib. All parts must
// pass validate(); geometry and basis have the same active nodes.
std::vector<std::uint8_t> encode_basis(const LevelGeometry& geometry, const Basis& basis, const Skin& skin);
// Any bytes: a valid basis, or a refusal of one line.
Result<HairBasis> decode_basis(std::span<const std::uint8_t> bytes);

}  // namespace hairnet::wire
