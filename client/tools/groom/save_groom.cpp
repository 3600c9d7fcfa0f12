#include "client/tools/groom/save_groom.hpp"

#include <cstdio>

#include "client/files/write_file.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::groom {

Result<void> save_groom(const Groom& groom, const std::string& path) {
  const std::vector<std::uint8_t> bytes = wire::encode_groom(groom);
  const Result<void> written = write_file(path, std::as_bytes(std::span(bytes)));
  if (!written) return Refusal(path + ": " + written.error());
  std::printf("%s: %zu strands, %zu points, %.1f MB\n", path.c_str(), groom.strand_count(), groom.points.size(),
              static_cast<double>(bytes.size()) / 1e6);
  return {};
}

}  // namespace hairnet::groom
