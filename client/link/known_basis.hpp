#pragma once

#include <utility>

#include "schema/codec/frame.hpp"
#include "schema/wire/basis_file.hpp"

namespace hairnet::link {

// The data for decoding frames of a groom. Immutable, so that many characters and cores share one.
struct KnownBasis {
  explicit KnownBasis(wire::HairBasis b) : hair(std::move(b)), code(hair.basis.deviation_m) {}
  wire::HairBasis hair;
  // Decodes coefficients of this basis.
  codec::CoefficientCode code;
};

}  // namespace hairnet::link
