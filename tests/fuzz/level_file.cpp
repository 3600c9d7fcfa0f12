#include "schema/wire/level_file.hpp"
#include "tests/fuzz/target.hpp"

// A level file whose checksum is right and whose content is anything: refused with a line, or levels that a solver may
// run.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  std::vector<std::uint8_t> bytes(data, data + size);
  if (size >= wire::kLevelFileHeaderBytes) wire::set_level_file_checksum(bytes);
  const wire::DecodedLevels got = wire::decode_levels(bytes, {});
  fuzz::require((got.error == wire::LevelFileError::none) == got.detail.empty(), "an error has a line");
  fuzz::require((got.error == wire::LevelFileError::none) == (got.levels != nullptr), "levels or an error");
  if (!got.levels) return 0;
  for (const Level& level : got.levels->levels) fuzz::require(validate(level).empty(), "valid: " + validate(level));
  return 0;
}
