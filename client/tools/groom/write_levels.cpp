#include <cstdio>
#include <filesystem>

#include "client/files/write_file.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/tools/groom/read_groom.hpp"
#include "core/levels/build.hpp"
#include "schema/wire/level_file.hpp"

namespace hairnet::groom {

Result<void> write_levels(const LevelsOptions& options) {
  const std::string out =
      options.out.empty() ? std::filesystem::path(options.groom).replace_extension(".levels").string() : options.out;
  if (const Result<void> possible = check_can_write({out}); !possible) return possible;
  const Result<GroomFile> file = read_groom(options.groom);
  if (!file) return Refusal(file.error());
  // It builds on one thread, without callbacks: nothing stops it, so the levels are never null.
  const std::vector<std::uint8_t> bytes = wire::encode_levels(file->hash, *build_levels(file->groom));
  const Result<void> written = write_file(out, std::as_bytes(std::span(bytes)));
  if (!written) return Refusal(out + ": " + written.error());
  std::printf("%s: %.1f MB\n", out.c_str(), static_cast<double>(bytes.size()) / 1e6);
  return {};
}

}  // namespace hairnet::groom
