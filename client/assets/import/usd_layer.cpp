#include "client/assets/import/usd_layer.hpp"

#include <string_view>
#include <utility>

#include "client/assets/import/byte_reader.hpp"
#include "client/assets/import/parse_text.hpp"

namespace hairnet::usda {
namespace {

// The first file of a USD archive, which is its scene. Such archives are never packed. USD demands that files of an
// archive are stored and begin at multiples of 64 bytes, so the scene is a part of `bytes`.
Result<std::span<const std::byte>> scene_of_archive(std::span<const std::byte> bytes) {
  // The header of a zip entry, in this order: signature, version and flags in 8 bytes, the method (0 is stored), time
  // and checksum in 8, the stored size and the original size in 4 each, and the lengths of the name and of the extra
  // field.
  constexpr std::size_t kHeaderBytes = 30;
  ByteReader in(bytes);
  if (!in.has(kHeaderBytes)) return Refusal("truncated: shorter than the header of an archive");
  in.skip(8);
  if (in.u16() != 0)
    return Refusal("its scene is packed, which a .usdz does not allow: usdcat FILE -o hair.usda unpacks it");
  in.skip(8);
  const std::size_t size = in.u32();
  in.skip(4);
  // The name and the extra field stand between the header and the scene.
  const std::size_t skipped = std::size_t{in.u16()} + in.u16();
  if (!in.has(skipped + size)) return Refusal("truncated: its scene is longer than the file");
  return bytes.subspan(in.at() + skipped, size);
}

}  // namespace

Result<Layer> open_layer(std::span<const std::byte> bytes, Content content, std::string& unpacked) {
  constexpr std::string_view kZip = "PK\x03\x04", kMark = "\xef\xbb\xbf";
  if (as_text(bytes).starts_with(kZip)) {
    const auto scene = scene_of_archive(bytes);
    if (!scene) return Refusal(scene.error());
    bytes = *scene;
  }
  // A crate becomes text first, and then takes the same way as text.
  std::string_view text = as_text(bytes);
  if (text.starts_with(kCrateMagic)) {
    Result<std::string> written = text_of_crate(bytes, content);
    if (!written) return Refusal(written.error());
    unpacked = std::move(*written);
    text = unpacked;
  }
  // Some editors put a mark of UTF-8 before the text.
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
  if (!text.starts_with("#usda ") && !text.starts_with("#sdf "))
    return Refusal("not a USD file: it begins neither with #usda nor with PXR-USDC");
  return parse(text);
}

}  // namespace hairnet::usda
