#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/build/level.hpp"
#include "core/pose/pose.hpp"
#include "schema/codec/frame_codec.hpp"

namespace hairnet::link {

// One character at one tick, decoded.
struct Frame {
  std::uint32_t member = 0;
  std::uint32_t character = 0;  // one's own number for it; 0: another's
  LevelIndex level = LevelIndex::rigid;
  codec::ErrorClass error_class = codec::ErrorClass::normal;
  bool discontinuous = false;    // teleport, reset or level switch: do not interpolate from the last frame
  bool asleep = false;           // nothing will change, and no frame come, before the character wakes
  bool kept = false;             // the hair as it was when a server was lost: the next one has none of it yet
  std::uint8_t step_stride = 1;  // ticks from one step of the character to the next
  float step_s = 0;              // the same in seconds; 0: not known
  Pose pose;                     // the one the step used
  // 3 an active node, head space, in units of the class's step, and of 32 steps a second (codec::dequantise_*). The
  // velocity is the node's in the world, in head axes. Empty: rigid; not sent.
  std::vector<std::int16_t> displacements, velocities;
  std::shared_ptr<const LevelGeometry> geometry;  // of the level; null: rigid
};

struct FrameBatch {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;  // server clock: when the poses were sampled (tick time - pose delay)
  std::vector<Frame> frames;
};

}  // namespace hairnet::link
