#include "client/tools/groom/read_groom.hpp"

#include "client/assets/made_spec.hpp"
#include "client/files/read_file.hpp"

namespace hairnet::groom {

Result<GroomFile> read_groom(const std::string& path) {
  if (is_made_spec(path)) {
    return Refusal(path + ": give a file; 'hairnet-groom make " + std::string(made_name(path)) +
                   " --out FILE' makes one");
  }
  const Result<std::vector<std::byte>> bytes = read_file(path);
  if (!bytes) return Refusal(path + ": " + bytes.error());
  Result<Groom> groom = wire::decode_groom(as_octets(*bytes));
  if (!groom) return Refusal(path + ": " + groom.error());
  if (groom->points.empty()) return Refusal(path + ": there is no hair");
  return GroomFile{wire::hash_groom(as_octets(*bytes)), std::move(*groom)};
}

}  // namespace hairnet::groom
