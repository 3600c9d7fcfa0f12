#include "tests/fuzz/imported_strands.hpp"

// A .tfx, mostly the text of version 2 gives valid strands or a refusal.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  return fuzz::require_strands(decode_tressfx(std::as_bytes(std::span(data, size))), size);
}
