#include "client/assets/import/imported_body.hpp"
#include "tests/fuzz/imported_body.hpp"
#include "tests/fuzz/imported_strands.hpp"

// A USD file, text or binary, gives valid strands or a refusal, and a valid mesh or a refusal.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  fuzz::require_mesh(fuzz::mesh_of(decode_usd_body(std::as_bytes(std::span(data, size)))));
  return fuzz::require_strands(decode_usd_curves(std::as_bytes(std::span(data, size))), size);
}
