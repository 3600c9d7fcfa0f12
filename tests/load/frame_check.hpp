#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/pose/pose.hpp"
#include "tests/load/virtual_client.hpp"

namespace hairnet::load {

// Compares the frames of some characters with rules that any lattice obeys:
//   pose_invalid        numbers finite, rotations of unit length
//   beyond_bound        hair no further than kDisplacementMax_m from its design
//   tick_went_back      newer frames of a session are of later ticks
//   moves_at_rest       5 s after the head came to rest hair moves no more than 5 mm from frame to frame, nor while the
//                       connection, or the server, was away; true in still air only
class FrameCheck final : public FrameWatcher {
 public:
  FrameCheck(std::uint64_t seed, double share) : seed_(seed), share_(share) {}
  void on_welcome(std::uint32_t client) override { ++welcomes_[client]; }
  void on_frame(std::uint32_t client, const FrameSeen& frame) override;

  [[nodiscard]] std::uint64_t checked() const { return checked_; }
  [[nodiscard]] const std::map<std::string, std::uint64_t>& failures() const { return failures_; }
  [[nodiscard]] std::uint64_t failure_count() const;

 private:
  [[nodiscard]] bool looks_at(std::uint32_t client, std::uint32_t character) const;
  struct Subject {
    std::uint64_t tick = 0;
    // The number of the client's welcomes when the last frame came.
    std::uint64_t welcome = 0;
    // The client is back after a loss of its connection, and the character does not have its former level yet.
    bool returned = false;
    Pose pose;
    // The sample time since which the pose and the level have not changed.
    std::int64_t rest_since_ns = 0;
    LevelIndex level = LevelIndex::rigid;
    std::vector<float> coefficients;
  };
  void check_rest(Subject& subject, const FrameSeen& frame);

  std::uint64_t seed_;
  double share_;
  std::uint64_t checked_ = 0;
  std::map<std::string, std::uint64_t> failures_;
  // The number of welcomes of each client.
  std::unordered_map<std::uint32_t, std::uint64_t> welcomes_;
  // The characters that are checked, by the client's number in the upper 32 bits and the character's in the lower ones.
  std::unordered_map<std::uint64_t, Subject> subjects_;
};

}  // namespace hairnet::load
