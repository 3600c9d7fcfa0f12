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
  std::uint32_t member = 0;              // the character's number in the room
  std::uint32_t character = 0;           // this client's own number; 0: another client's character
  LevelIndex level = LevelIndex::rigid;  // that the server steps
  bool discontinuous = false;            // teleport or reset: do not interpolate from the last frame
  bool asleep = false;           // the lattice is at rest: the server sends no further frame until the character wakes
  bool repeated = false;         // it came already, before its basis
  bool last_known = false;       // the last known hair from before a reconnect; the new server has no lattice yet
  std::uint8_t step_stride = 1;  // ticks from one step of the character to the next
  float step_s = 0;              // the same in seconds; 0: not known
  Pose pose;                     // of the head and shoulders at that step
  std::vector<float> coefficients;          // m, of the basis; those that are missing at the end are 0
  std::shared_ptr<const KnownBasis> basis;  // null: the hair is at rest, or its basis has not arrived yet
};

// The displacements of the basis's active nodes, in head space, m; empty without a basis.
void displacements_of(const Frame& frame, std::vector<Vec3f>& out);

// The frames of one tick.
struct FrameBatch {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;  // server clock: when the poses were sampled (tick time - pose delay)
  std::int64_t received_ns = 0;     // this client's clock: when it came, or was decoded at last
  std::vector<Frame> frames;
};

}  // namespace hairnet::link
