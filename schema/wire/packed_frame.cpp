#include "schema/wire/packed_frame.hpp"

#include <bit>
#include <cstring>

#include "core/assert.hpp"
#include "schema/wire/message_codec.hpp"

namespace hairnet::wire {

std::uint8_t* write_varint(std::uint64_t value, std::uint8_t* at) {
  for (; value >= 0x80; value >>= 7) *at++ = static_cast<std::uint8_t>(value | 0x80);
  *at++ = static_cast<std::uint8_t>(value);
  return at;
}

std::size_t varint_bytes(std::uint64_t value) {
  std::size_t count = 1;
  for (; value >= 0x80; value >>= 7) ++count;
  return count;
}

std::size_t packed_bytes(const Frame& frame, std::uint32_t member_before) {
  return varint_bytes(frame.member - member_before) + 1 + varint_bytes(frame.content.size()) + frame.content.size();
}

std::uint8_t* write_frame(const Frame& frame, std::uint32_t member_before, std::uint8_t* at) {
  at = write_varint(frame.member - member_before, at);
  const auto log2_stride = static_cast<unsigned>(std::countr_zero(unsigned{frame.step_stride}));
  *at++ = static_cast<std::uint8_t>(static_cast<unsigned>(frame.level) | unsigned{frame.discontinuous} << 3 |
                                    unsigned{frame.asleep} << 4 | log2_stride << 5 | unsigned{frame.evaluated} << 7);
  at = write_varint(frame.content.size(), at);
  if (!frame.content.empty()) std::memcpy(at, frame.content.data(), frame.content.size());
  return at + frame.content.size();
}

std::string read_frame(Unpacker& in, std::uint32_t member_before, Frame& out) {
  std::uint32_t step = 0, byte_count = 0;
  std::uint8_t head = 0;
  if (!in.take_varint(step) || !in.take(head) || !in.take_varint(byte_count) || !in.take(byte_count, out.content))
    return "frame batch: ends within a frame";
  // Members ascend, so one batch cannot have two frames of one member, and the sum cannot wrap.
  if (step == 0 || step > 0xffffffffu - member_before) return "frame batch: members do not ascend";
  out.member = member_before + step;
  HAIRNET_ASSERT(out.member > member_before);
  if (std::string error = read_enum(static_cast<fb::LevelIndex>(head & 7), "level", out.level); !error.empty())
    return error;
  out.discontinuous = (head & 8) != 0;
  out.asleep = (head & 16) != 0;
  // Two bits can say four strides, and the fourth does not exist.
  const unsigned log2_stride = head >> 5 & 3;
  if (log2_stride > 2) return "frame: no such stride";
  out.evaluated = (head & 128) != 0;
  if (out.evaluated && out.level != LevelIndex::learnt) return "frame: evaluated on another level than learnt";
  out.step_stride = static_cast<std::uint8_t>(1u << log2_stride);
  return {};
}

}  // namespace hairnet::wire
