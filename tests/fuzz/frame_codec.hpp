#pragma once

#include <vector>

#include "core/random.hpp"
#include "schema/codec/frame_codec.hpp"

// The contexts of the frame codec's fuzzer: the first byte of an input chooses history, lattice and parts.
namespace hairnet::fuzz {

struct CodecSetting {
  std::size_t order;
  bool large, velocities, ranged;
};
inline CodecSetting codec_setting(std::uint8_t byte) {
  return {std::size_t{byte} & 3, (byte & 4) != 0, (byte & 8) != 0, (byte & 16) != 0};
}

// A grid with every fifth node missing.
inline LevelGeometry codec_geometry(bool large) {
  LevelGeometry out;
  out.lattice.dims = large ? std::array{6, 5, 4} : std::array{2, 3, 2};
  for (std::uint32_t node = 0; node < out.lattice.node_count(); ++node) {
    if (node % 5 != 4) out.active_nodes.push_back(node);
  }
  return out;
}

// Small smooth motion, the oldest last; `frame` 0 is the one to encode, 1 to 3 its history.
inline std::vector<codec::FrameIntegers> codec_frames(std::size_t node_count) {
  Random random(1);
  std::vector<codec::FrameIntegers> out(1 + codec::kHistoryMax);
  for (std::size_t age = out.size(); age-- > 0;) {
    codec::FrameIntegers& frame = out[age];
    const codec::FrameIntegers* before = age + 1 < out.size() ? &out[age + 1] : nullptr;
    for (std::size_t i = 0; i < codec::kBoneIntegers; ++i)
      frame.bones[i] = (before ? before->bones[i] : 0) + static_cast<std::int32_t>(random.between(-200, 300));
    for (std::size_t i = 0; i < 3 * node_count; ++i) {
      frame.nodes.push_back(
          static_cast<std::int16_t>((before ? before->nodes[i] : 100) + static_cast<int>(random.between(-9, 12))));
      frame.velocities.push_back(static_cast<std::int16_t>(random.between(-40, 40)));
    }
  }
  return out;
}

inline codec::NodeRange codec_range(const CodecSetting& setting, std::size_t node_count) {
  const auto count = static_cast<std::uint32_t>(node_count);
  return setting.ranged ? codec::NodeRange{count / 3, count / 2} : codec::NodeRange{0, count};
}

}  // namespace hairnet::fuzz
