#include "tests/fuzz/imported_strands.hpp"

// A USD file, text or binary, gives sound strands or a refusal.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  return fuzz::require_strands(decode_usd_curves(std::as_bytes(std::span(data, size))), size);
}
