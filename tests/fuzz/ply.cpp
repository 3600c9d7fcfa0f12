#include "tests/fuzz/imported_strands.hpp"

// A .ply gives sound strands or a refusal.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  return fuzz::require_strands(decode_ply(std::as_bytes(std::span(data, size))), size);
}
