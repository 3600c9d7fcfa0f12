#pragma once

#include <cstddef>
#include <cstdint>

// Numbers of RFC 1951 that both directions need.
namespace hairnet::wasm {

inline constexpr std::uint32_t kCodeBitsMax = 15;
inline constexpr std::size_t kEndOfBlock = 256;    // the symbol behind the literals
inline constexpr std::size_t kLengthSymbols = 19;  // of the code of a block's code lengths

}  // namespace hairnet::wasm
