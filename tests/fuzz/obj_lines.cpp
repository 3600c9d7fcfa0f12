#include "client/assets/import/obj.hpp"
#include "tests/fuzz/imported_strands.hpp"

// The lines of an .obj give valid strands or a refusal.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  return fuzz::require_strands(decode_obj_strands(text), size);
}
