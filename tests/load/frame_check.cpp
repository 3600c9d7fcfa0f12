#include "tests/load/frame_check.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/random.hpp"

namespace hairnet::load {
namespace {

// The bound of Level::displacement_max_m.
constexpr float kDisplacementMax_m = 10;
// So long after the head came to rest, hair must be at rest too: it may move by kRestMotionMax_m from frame to frame.
constexpr std::int64_t kRest_ns = 5'000'000'000;
constexpr float kRestMotionMax_m = 0.005f;
// A smaller change of a pose is no motion. It is in metres for positions, and of the numbers of a quaternion.
constexpr double kRestPose = 1e-6;

std::uint64_t key_of(std::uint32_t client, std::uint32_t character) {
  return std::uint64_t{client} << 32 | character;
}

// RMS over the hair, m; coefficients that are missing at the end are 0.
float distance_m(std::span<const float> a, std::span<const float> b) {
  float squares = 0;
  for (std::size_t k = 0; k < std::max(a.size(), b.size()); ++k) {
    const float apart = (k < a.size() ? a[k] : 0) - (k < b.size() ? b[k] : 0);
    squares += apart * apart;
  }
  return std::sqrt(squares);
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

void FrameCheck::on_frame(std::uint32_t client, const FrameSeen& frame) {
  if (!frame.pose || !looks_at(client, frame.character)) return;
  ++checked_;
  Subject& subject = subjects_[key_of(client, frame.character)];
  if (!is_valid(*frame.pose)) ++failures_["pose_invalid"];
  const std::uint64_t welcome = welcomes_[client];
  const bool is_first = std::exchange(subject.welcome, welcome) != welcome;
  subject.returned = subject.returned || (is_first && subject.tick > 0);
  if (!is_first && frame.tick <= subject.tick && subject.tick > 0) ++failures_["tick_went_back"];
  subject.tick = frame.tick;
  if (!(distance_m(frame.coefficients, {}) <= kDisplacementMax_m)) ++failures_["beyond_bound"];
  check_rest(subject, frame);
}

void FrameCheck::check_rest(Subject& subject, const FrameSeen& frame) {
  const std::int64_t now_ns = frame.sample_time_local_ns;
  if (subject.returned && subject.level != frame.level && same_pose(subject.pose, *frame.pose)) return;
  // The first frame of a session is marked discontinuous, although the hair continues from its last state.
  const bool returned = std::exchange(subject.returned, false);
  const bool comparable = subject.level == frame.level && (returned || !frame.discontinuous);
  if (!comparable || !same_pose(subject.pose, *frame.pose)) subject.rest_since_ns = now_ns;
  if (now_ns - subject.rest_since_ns > kRest_ns) {
    if (distance_m(frame.coefficients, subject.coefficients) > kRestMotionMax_m) ++failures_["moves_at_rest"];
  }
  subject.pose = *frame.pose;
  subject.level = frame.level;
  subject.coefficients.assign(frame.coefficients.begin(), frame.coefficients.end());
}

std::uint64_t FrameCheck::failure_count() const {
  std::uint64_t sum = 0;
  for (const auto& [reason, count] : failures_) sum += count;
  return sum;
}

}  // namespace hairnet::load
