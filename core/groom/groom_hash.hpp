#pragma once

#include <array>
#include <cstdint>

namespace hairnet {

// BLAKE2b-256 of the bytes of a groom's file. The hash names the groom on the wire and on disk, so equal files are
// stored and built once.
using GroomHash = std::array<std::uint8_t, 32>;

}  // namespace hairnet
