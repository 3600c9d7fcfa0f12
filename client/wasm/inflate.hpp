#pragma once

#include <cstdint>
#include <span>

#include "schema/bytes/deflate.hpp"

namespace hairnet::wasm {

// bytes::inflate_into without zlib, which Debian has no package of for WebAssembly. A stream that zlib refuses is
// refused, and one that it reads gives the same bytes. It wants the whole stream at once, and the exact size of what
// comes out.
bytes::InflateError inflate_into(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out);

}  // namespace hairnet::wasm
