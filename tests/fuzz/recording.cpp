#include "schema/wire/recording.hpp"
#include "tests/fuzz/target.hpp"

// A recording's reader advances entry by entry, or gives a reason; its entries can be written again.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  const std::vector<std::uint8_t> bytes(data, data + size);
  std::span<const std::uint8_t> rest = bytes;
  while (!rest.empty()) {
    const std::size_t left = rest.size();
    const Result<wire::RecordEntry> got = wire::take_record_entry(rest);
    if (!got) {
      fuzz::require(!got.error().empty(), "a refusal has a line");
      return 0;
    }
    fuzz::require(rest.size() < left, "moves on");
    const std::vector<std::uint8_t> encoded = wire::encode_record_entry(*got);
    std::span<const std::uint8_t> again = encoded;
    fuzz::require(wire::take_record_entry(again).has_value() && again.empty(), "encoded again it is refused");
  }
  return 0;
}
