#include "client/tools/groom/save_groom.hpp"

#include <cstdio>

#include "client/files/write_file.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::groom {
namespace {

Result<void> write_bytes(std::span<const std::uint8_t> bytes, const std::string& path) {
  const Result<void> written = write_file(path, std::as_bytes(bytes));
  if (!written) return Refusal(path + ": " + written.error());
  return {};
}

}  // namespace

Result<void> write_groom(const Groom& groom, const std::string& path) {
  return write_bytes(wire::encode_groom(groom), path);
}

Result<void> save_groom(const Groom& groom, const std::string& path) {
  const std::vector<std::uint8_t> bytes = wire::encode_groom(groom);
  if (const Result<void> written = write_bytes(bytes, path); !written) return written;
  std::printf("%s: %zu strands, %zu points, %.1f MB\n", path.c_str(), groom.strand_count(), groom.points.size(),
              static_cast<double>(bytes.size()) / 1e6);
  return {};
}

}  // namespace hairnet::groom
