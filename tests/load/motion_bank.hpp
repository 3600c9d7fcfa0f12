#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/pose/motion.hpp"
#include "core/result.hpp"

namespace hairnet::load {

// The poses of some motions, made once at the rate they are sent at and played in a loop.
class MotionBank {
 public:
  // Motions as load_motion takes them.
  static Result<MotionBank> load(const std::vector<std::string>& specs, double pose_hz);
  // For tests.
  static MotionBank of(std::vector<Motion> motions, double pose_hz);

  struct Step {
    const Pose* pose = nullptr;  // stays where it is
    bool teleport = false;       // does not continue from the step before
  };
  [[nodiscard]] Step step(std::size_t motion, std::uint64_t index) const;
  [[nodiscard]] std::size_t count() const { return loops_.size(); }

 private:
  struct Loop {
    std::vector<Pose> poses;
    std::vector<bool> teleports;
  };
  std::vector<Loop> loops_;
};

}  // namespace hairnet::load
