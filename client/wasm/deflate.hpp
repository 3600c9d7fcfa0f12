#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace hairnet::wasm {

// bytes::deflated without zlib: Huffman codes alone, without matches, which the planes of numbers in our files hardly
// have.
std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes);

}  // namespace hairnet::wasm
