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
  std::uint64_t character = 0;           // session << 32 | client's number
  LevelIndex level = LevelIndex::rigid;  // that was stepped
  bool discontinuous = false;
  bool asleep = false;
  Pose pose;
  std::span<const Vec3f>
      displacement;     // of the level, or of the finest where frames came from a server; active order, head space, m
  int step_stride = 1;  // ticks from one step to the next
};

// A folder of arrays with one row a frame; the README describes them.
class FrameTrace {
 public:
  // Makes the folder if it does not exist.
  static Result<FrameTrace> create(const std::string& folder);
  FrameTrace(FrameTrace&&) noexcept;
  FrameTrace& operator=(FrameTrace&&) noexcept;
  ~FrameTrace();
  void add(const TracedFrame& frame);
  Result<void> finish();

 private:
  struct Files;
  explicit FrameTrace(std::unique_ptr<Files> files);
  std::unique_ptr<Files> files_;
};

}  // namespace hairnet
