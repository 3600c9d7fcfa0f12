#include "client/assets/load_groom.hpp"

#include "client/assets/made_spec.hpp"
#include "client/files/read_file.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet {
namespace {

// Reads a groom file and decodes what `decode` finds in it.
template <class Decode>
auto decoded(const std::string& path, Decode decode) -> decltype(decode({})) {
  const Result<std::vector<std::byte>> bytes = read_file(path);
  if (!bytes) return Refusal(path + ": " + bytes.error());
  auto value = decode({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()});
  if (!value) return Refusal(path + ": " + value.error());
  return value;
}

}  // namespace

Result<Groom> load_groom(const std::string& spec, const HairstyleOptions& made, const HairImport& import) {
  if (is_made_spec(spec)) {
    Result<Groom> groom = make_hairstyle(made_name(spec), made);
    if (!groom) return Refusal(spec + ": " + groom.error());
    return groom;
  }
  // An import takes one file here. Several files of one head come through `load_hair`.
  if (is_foreign_file(spec)) return load_hair({{spec}, {}, {}, {}}, import);
  return decoded(spec, [](std::span<const std::uint8_t> bytes) { return wire::decode_groom(bytes); });
}

Result<std::shared_ptr<const LearntHair>> load_learnt(const std::string& spec) {
  // A null pointer is no error: callers then upload the groom without a network.
  if (is_made_spec(spec) || is_foreign_file(spec)) return nullptr;
  return decoded(spec, [](std::span<const std::uint8_t> bytes) { return wire::decode_learnt_of_groom(bytes); });
}

}  // namespace hairnet
