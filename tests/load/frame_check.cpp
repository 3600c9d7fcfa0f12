#include "tests/load/frame_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/random.hpp"

namespace hairnet::load {
namespace {

constexpr float kDisplacementMax_m = 10;  // Level::displacement_max_m
constexpr std::int64_t kRest_ns = 5'000'000'000;
constexpr float kRestMotionMax_m = 0.005f;
constexpr double kRestPose = 1e-6;  // m, and of quaternions: less is no motion

std::uint64_t key_of(std::uint32_t client, std::uint32_t character) {
  return std::uint64_t{client} << 32 | character;
}

bool same_pose(const Pose& a, const Pose& b) {
  return std::ranges::equal(a.bones, b.bones, [](const RigidTransform& p, const RigidTransform& q) {
    return (p.position - q.position).cwiseAbs().maxCoeff() <= kRestPose &&
           (p.rotation.coeffs() - q.rotation.coeffs()).cwiseAbs().maxCoeff() <= kRestPose;
  });
}

}  // namespace

bool FrameCheck::looks_at(std::uint32_t client, std::uint32_t character) const {
  return Random(seed_, key_of(client, character)).unit() < share_;
}

void FrameCheck::on_frame(std::uint32_t client, const FrameSeen& frame, std::size_t groom) {
  if (!frame.pose || !looks_at(client, frame.character)) return;
  ++checked_;
  Subject& subject = subjects_[key_of(client, frame.character)];
  if (!is_valid(*frame.pose)) ++failures_["pose_invalid"];
  const std::uint64_t welcome = welcomes_[client];
  const bool is_first = std::exchange(subject.welcome, welcome) != welcome;
  subject.returned = subject.returned || (is_first && subject.tick > 0);
  if (!is_first && frame.tick <= subject.tick && subject.tick > 0) ++failures_["tick_went_back"];
  subject.tick = frame.tick;
  const auto bound = static_cast<float>(kDisplacementMax_m) + frame.step_m;
  for (const std::int16_t value : frame.displacements) {
    if (std::abs(static_cast<float>(value)) * frame.step_m <= bound) continue;
    ++failures_["beyond_bound"];
    break;
  }
  if (!frame.displacements.empty()) {
    const auto known = node_counts_.emplace(std::pair(groom, frame.level), frame.displacements.size());
    if (known.first->second != frame.displacements.size()) ++failures_["node_count_changed"];
  }
  check_rest(subject, frame);
}

void FrameCheck::check_rest(Subject& subject, const FrameSeen& frame) {
  const std::int64_t now_ns = frame.sample_time_local_ns;
  if (subject.returned && subject.level != frame.level && same_pose(subject.pose, *frame.pose)) return;
  // The first frame of a session is marked discontinuous, although the hair continues from its last state.
  const bool returned = std::exchange(subject.returned, false);
  const bool comparable = subject.level == frame.level && subject.step_m == frame.step_m &&
                          (returned || !frame.discontinuous) &&
                          subject.displacements.size() == frame.displacements.size();
  if (!comparable || !same_pose(subject.pose, *frame.pose)) subject.rest_since_ns = now_ns;
  if (now_ns - subject.rest_since_ns > kRest_ns) {
    for (std::size_t i = 0; i < frame.displacements.size(); ++i) {
      const int moved = std::abs(frame.displacements[i] - subject.displacements[i]);
      if (static_cast<float>(moved) * frame.step_m <= kRestMotionMax_m) continue;
      ++failures_["moves_at_rest"];
      break;
    }
  }
  subject.pose = *frame.pose;
  subject.level = frame.level;
  subject.step_m = frame.step_m;
  subject.displacements.assign(frame.displacements.begin(), frame.displacements.end());
}

std::uint64_t FrameCheck::failure_count() const {
  std::uint64_t sum = 0;
  for (const auto& [reason, count] : failures_) sum += count;
  return sum;
}

}  // namespace hairnet::load
