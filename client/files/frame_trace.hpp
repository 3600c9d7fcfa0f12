#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"
#include "core/result.hpp"

namespace hairnet {

struct TracedFrame {
  std::uint64_t tick = 0;
  // The name of the character: session << 32 | the owner's number for it.
  std::uint64_t character = 0;
  // The level that was stepped.
  LevelIndex level = LevelIndex::rigid;
  bool discontinuous = false;
  bool asleep = false;
  Pose pose;
  // The displacement of the level, or of the finest where frames came from a server; in active order, head space, m.
  std::span<const Vec3f> displacement;
  // The number of ticks from one step of the character to the next.
  int step_stride = 1;
};

// A folder of arrays with one row a frame; the README describes them.
class FrameTrace {
 public:
  // Makes the folder if it does not exist.
  static Result<FrameTrace> create(const std::string& folder);
  FrameTrace(FrameTrace&&) noexcept;
  FrameTrace& operator=(FrameTrace&&) noexcept;
  ~FrameTrace();
  // Appends a row. A failure to write shows in finish().
  void add(const TracedFrame& frame);
  // Renames the three files to their final names. Without this call they do not appear, and the folder stays.
  Result<void> finish();

 private:
  struct Files;
  explicit FrameTrace(std::unique_ptr<Files> files);
  std::unique_ptr<Files> files_;
};

}  // namespace hairnet
