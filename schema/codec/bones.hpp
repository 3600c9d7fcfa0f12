#pragma once

#include "schema/codec/bits.hpp"
#include "schema/codec/frame_codec.hpp"

namespace hairnet::codec {

// Code the pose of a frame. After the end of the data decode_bones returns some values; check reader.beyond_end().
void encode_bones(const FrameIntegers& frame, History history, BitWriter& writer);
void decode_bones(BitReader& reader, History history, FrameIntegers& frame);

// An upper bound of the bytes of a pose.
inline constexpr std::size_t kBonesBytesMax = 512;

}  // namespace hairnet::codec
