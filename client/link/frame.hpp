#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"
#include "schema/codec/frame_codec.hpp"

namespace hairnet::link {

// One character at one tick, decoded.
struct Frame {
  std::uint32_t member = 0;
  std::uint32_t character = 0;  // this client's number for its own character; 0: another client's
  LevelIndex level = LevelIndex::rigid;
  codec::ErrorClass error_class = codec::ErrorClass::half_mm;
  bool discontinuous = false;    // teleport, reset or level switch: do not interpolate from the last frame
  bool asleep = false;           // the lattice is at rest: the server sends no further frame until the character wakes
  bool last_known = false;       // the last known hair from before a reconnect; the new server has no lattice yet
  std::uint8_t step_stride = 1;  // ticks from one step of the character to the next
  float step_s = 0;              // the same in seconds; 0: not known
  Pose pose;                     // the pose of the step
  // Three numbers per active node, in head axes (codec::dequantise_*). A displacement counts steps of `error_class`; a
  // velocity's unit is 32 steps of `error_class` per second, in the world. Displacements are empty for a rigid
  // level, velocities when the server did not send them.
  std::vector<std::int16_t> displacements, velocities;
  std::shared_ptr<const LevelGeometry> geometry;  // of the level; null: rigid
};

// The frames of one tick.
struct FrameBatch {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;  // server clock: when the poses were sampled (tick time - pose delay)
  std::vector<Frame> frames;
};

}  // namespace hairnet::link
