#include <span>

#include "client/assets/import/imported_body.hpp"
#include "tests/fuzz/imported_body.hpp"

// A glTF file, text or binary, gives a valid mesh or a refusal, and asks for no file outside its folder.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  const auto beside = [&](const std::string& name) -> Result<std::vector<std::byte>> {
    fuzz::require(!name.starts_with('/') && name.find("..") == std::string::npos, "a file in the same folder: " + name);
    const auto bytes = std::as_bytes(std::span(data, size));
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  };
  return fuzz::require_mesh(fuzz::mesh_of(decode_gltf_body(std::as_bytes(std::span(data, size)), beside)));
}
