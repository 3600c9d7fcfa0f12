#include "schema/wire/groom_file.hpp"
#include "tests/fuzz/target.hpp"

// A groom file is refused with one line, or gives a valid groom that survives another round unchanged.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  const std::vector<std::uint8_t> bytes(data, data + size);
  const Result<Groom> got = wire::decode_groom(bytes);
  if (!got) {
    fuzz::require(!got.error().empty(), "a refusal has a line");
    return 0;
  }
  fuzz::require(validate(*got).empty(), "valid: " + validate(*got));
  const std::vector<std::uint8_t> encoded = wire::encode_groom(*got);
  const Result<Groom> again = wire::decode_groom(encoded);
  fuzz::require(again.has_value(), "encoded again it is refused");
  fuzz::require(wire::encode_groom(*again) == encoded, "the same bytes again");
  return 0;
}
