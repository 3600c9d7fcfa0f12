#include "schema/wire/learnt_file.hpp"

#include <string>
#include <utility>

#include "core/assert.hpp"
#include "schema/wire/flatbuffer_convert.hpp"
#include "schema/wire/learnt_hair_table.hpp"
#include "schema/wire/packing.hpp"

namespace hairnet::wire {

std::vector<std::uint8_t> encode_learnt(const LearntHair& hair) {
  HAIRNET_ASSERT(validate(hair).empty());
  flatbuffers::FlatBufferBuilder to(std::size_t{1} << 16);
  const auto root = write_learnt(to, hair);
  return pack(finish(to, root, fb::LearntHairIdentifier()), kPackedLearnt);
}

Result<LearntHair> decode_learnt(std::span<const std::uint8_t> bytes) {
  const Result<std::vector<std::uint8_t>> table = unpack(bytes, kPackedLearnt);
  if (!table) return Refusal(table.error());
  const AlignedBytes aligned(*table);
  const auto* root = verified_root<fb::LearntHair>(aligned.bytes(), fb::LearntHairIdentifier());
  if (!root) return Refusal("not whole: no valid table of learnt hair");
  LearntHair out;
  // The file has no wind: a client evaluates learnt hair in still air only.
  if (std::string error = read_learnt(*root, nullptr, out); !error.empty()) return Refusal(std::move(error));
  return out;
}

}  // namespace hairnet::wire
