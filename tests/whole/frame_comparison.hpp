#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/modes/make_modes.hpp"
#include "tests/support/npy_reader.hpp"

namespace hairnet::whole {

// The arrays of a trace that client/files has written. Each row is the frame of one character at one tick.
struct Trace {
  explicit Trace(const std::string& folder);

  [[nodiscard]] std::int64_t level(std::size_t frame) const { return frames.row(frame)[2]; }
  [[nodiscard]] std::size_t count(std::size_t frame) const { return static_cast<std::size_t>(frames.row(frame)[5]); }
  [[nodiscard]] bool asleep(std::size_t frame) const { return frames.row(frame)[6] != 0; }
  [[nodiscard]] std::int64_t step_stride(std::size_t frame) const { return frames.row(frame)[7]; }
  // Returns the displacements of a frame, three numbers for each of count() nodes.
  [[nodiscard]] const float* displacement(std::size_t frame) const {
    return displacements.values.data() + 3 * frames.row(frame)[4];
  }
  [[nodiscard]] bool all_finite() const;

  support::NpyArray<std::int64_t> frames;
  support::NpyArray<float> poses, displacements;
  std::map<std::pair<std::int64_t, std::int64_t>, std::size_t> by_character_and_tick;
};

struct FrameComparison {
  // The numbers of compared frames, and of those whose hair is not at rest.
  std::size_t frames = 0, moving_frames = 0;
  // The number of compared frames on the learnt level.
  std::size_t learnt_frames = 0;
  // The number of frames soon after a change of level, whose hair is between both levels; they are not compared.
  std::size_t fading = 0;
  // The number of frames that were received, but not computed.
  std::size_t unknown = 0;
  std::size_t levels_differ = 0, poses_differ = 0, hair_differs = 0;
  // The number of ticks without a frame between a character's first and last frame, while it was awake.
  std::size_t missed_ticks = 0;
  // The largest RMS error over the hair of one frame.
  double error_mm_max = 0;
};

// Compares the frames that a client has received with those that were computed again from the server's recording.
// Received hair has the nodes of the finest level. Computed hair has those of its own level, learnt hair those of the
// finest one. `modes` are those of all grooms that may occur.
FrameComparison compare(const Trace& received, const Trace& computed,
                        const std::vector<std::shared_ptr<const Modes>>& modes);

// Returns for each character the RMS of the displacements in its last frame.
std::map<std::int64_t, double> last_rms_mm(const Trace& trace);

}  // namespace hairnet::whole
