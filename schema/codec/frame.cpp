#include "schema/codec/frame.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "schema/codec/pose_code.hpp"

namespace hairnet::codec {

std::span<const std::uint8_t> EncodedFrame::prefix(std::size_t count) const {
  count = std::min(count, ends.size());
  const std::uint32_t bits = count == 0 ? pose_bits : ends[count - 1];
  HAIRNET_ASSERT((bits + 7) / 8 <= bytes.size());
  return std::span(bytes).first((bits + 7) / 8);
}

void encode_frame(const Pose& pose, const CoefficientCode* code, std::span<const float> coefficients, unsigned step,
                  EncodedFrame& out) {
  HAIRNET_ASSERT(code || coefficients.empty());
  // The bound holds for any content, so the writer needs no check for each bit. One more coefficient stands for the
  // header of the coefficients.
  out.bytes.resize(kPoseBytesMax + (1 + coefficients.size()) * kCoefficientBytesMax + kWriterSlackBytes);
  out.ends.clear();
  BitWriter writer(out.bytes.data());
  encode_pose(pose, writer);
  out.pose_bits = writer.bit_count();
  if (!coefficients.empty()) encode_coefficients(*code, coefficients, step, writer, out.ends);
  // encode_coefficients() counts from the writer's position at its start, and prefix() counts from the frame's first
  // bit.
  for (std::uint32_t& end : out.ends) end += out.pose_bits;
  out.bytes.resize(writer.finish());
}

bool decode_frame(std::span<const std::uint8_t> bytes, const CoefficientCode* code, DecodedFrame& out) {
  BitReader reader(bytes);
  if (!decode_pose(reader, out.pose) || reader.beyond_end()) return false;
  out.coefficients.assign(code ? code->mode_count() : 0, 0);
  if (!code) return true;
  // Bytes after the last mode are refused, since no encoder writes them. Bits after an incomplete coefficient cannot be
  // judged: the server has cut them.
  return decode_coefficients(*code, reader, out.coefficients) < code->mode_count() || reader.ends_here();
}

}  // namespace hairnet::codec
