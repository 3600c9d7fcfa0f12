#include "tests/fuzz/imported_strands.hpp"

// A .npy or a .npz gives valid strands or a refusal.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  return fuzz::require_strands(decode_npy(std::as_bytes(std::span(data, size))), size);
}
