#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "client/link/known_basis.hpp"
#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"

namespace hairnet::link {

// One character at one tick, decoded.
struct Frame {
  // The character's number in the room.
  std::uint32_t member = 0;
  // This client's own number; zero means another client's character.
  std::uint32_t character = 0;
  // The level that the server steps.
  LevelIndex level = LevelIndex::rigid;
  // Marks a teleport or a reset: do not interpolate from the last frame.
  bool discontinuous = false;
  // The lattice is at rest: the server sends no further frame until the character wakes.
  bool asleep = false;
  // The frame was reported before, when its basis had not arrived.
  bool repeated = false;
  // The coefficients are the last known ones from before a reconnect, since the new server has no lattice yet.
  bool last_known = false;
  // The number of ticks from one step of the character to the next.
  std::uint8_t step_stride = 1;
  // The same in seconds; zero means not known.
  float step_s = 0;
  // The pose of the head and shoulders at that step.
  Pose pose;
  // Coefficients of the basis, m; those that are missing at the end are 0.
  std::vector<float> coefficients;
  // Null when the hair is at rest, or its basis has not arrived yet.
  std::shared_ptr<const KnownBasis> basis;
};

// The displacements of the basis's active nodes, in head space, m; empty without a basis.
void displacements_of(const Frame& frame, std::vector<Vec3f>& out);

// The frames of one tick.
struct FrameBatch {
  std::uint64_t tick = 0;
  // The time at which the poses were sampled (tick time minus pose delay), on the server's clock.
  std::int64_t sample_time_ns = 0;
  // The time at which the batch came, or could be decoded at last, on this client's clock.
  std::int64_t received_ns = 0;
  std::vector<Frame> frames;
};

}  // namespace hairnet::link
