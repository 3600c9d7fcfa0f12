#pragma once

#include <array>
#include <cstdint>

namespace hairnet {

using GroomHash = std::array<std::uint8_t, 32>;  // BLAKE2b-256 of the bytes of a groom's file, which name it

}  // namespace hairnet
