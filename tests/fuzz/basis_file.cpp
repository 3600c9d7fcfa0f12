#include "schema/wire/basis_file.hpp"
#include "schema/wire/packing.hpp"
#include "tests/fuzz/target.hpp"

// A basis file is refused with one line, or gives a valid basis that survives another round unchanged. The input is the
// table, which the target packs: bytes would hardly ever inflate.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  const std::vector<std::uint8_t> table(data, data + size);
  const Result<wire::HairBasis> got = wire::decode_basis(wire::pack(table, wire::kPackedBasis));
  if (!got) {
    fuzz::require(!got.error().empty(), "a refusal has a line");
    return 0;
  }
  fuzz::require(validate(got->basis).empty(), "valid: " + validate(got->basis));
  fuzz::require(validate(got->geometry).empty(), "valid: " + validate(got->geometry));
  fuzz::require(validate(got->skin).empty(), "valid: " + validate(got->skin));
  const std::vector<std::uint8_t> encoded = wire::encode_basis(got->geometry, got->basis, got->skin);
  const Result<wire::HairBasis> again = wire::decode_basis(encoded);
  fuzz::require(again.has_value(), "encoded again it is refused");
  fuzz::require(wire::encode_basis(again->geometry, again->basis, again->skin) == encoded, "the same bytes again");
  return 0;
}
