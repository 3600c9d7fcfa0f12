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
  // Makes a bank of motions that exist already; tests use it.
  static MotionBank of(std::vector<Motion> motions, double pose_hz);

  struct Step {
    // The bank owns the pose.
    const Pose* pose = nullptr;
    // The pose does not continue from that of the step before.
    bool teleport = false;
  };
  [[nodiscard]] Step step(std::size_t motion, std::uint64_t index) const;
  [[nodiscard]] std::size_t count() const { return loops_.size(); }

 private:
  // A motion, whose last step is followed by its first one.
  struct Loop {
    std::vector<Pose> poses;
    std::vector<bool> teleports;
  };
  std::vector<Loop> loops_;
};

}  // namespace hairnet::load
