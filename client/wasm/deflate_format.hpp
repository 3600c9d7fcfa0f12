#pragma once

#include <cstddef>
#include <cstdint>

// Numbers of RFC 1951 that both directions need.
namespace hairnet::wasm {

inline constexpr std::uint32_t kCodeBitsMax = 15;
// The symbol behind the literals.
inline constexpr std::size_t kEndOfBlock = 256;
// The number of symbols of the code of a block's code lengths.
inline constexpr std::size_t kLengthSymbols = 19;

}  // namespace hairnet::wasm
