#include "tests/support/deepmimic_clip.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace hairnet {
namespace {

using nlohmann::json;

// A frame has a duration (1 number), the root's position (3) and a rotation for each of the 13 joints: one angle for
// each of the 4 hinges, and a quaternion for the other 9.
constexpr std::size_t kFrameNumbers = 44;
// The limits refuse damaged files: no frame lasts longer, and no clip is so far away.
constexpr double kFrameMax_s = 10;
constexpr double kCoordinateMax_m = 1e4;

using Row = std::array<double, kFrameNumbers>;

constexpr bool is_hinge(DeepMimicJoint joint) {
  return joint == DeepMimicJoint::right_knee || joint == DeepMimicJoint::right_elbow ||
         joint == DeepMimicJoint::left_knee || joint == DeepMimicJoint::left_elbow;
}

Refusal of_frame(std::size_t index, const std::string& what) {
  return Refusal("frame " + std::to_string(index) + ": " + what);
}

Result<Row> read_row(const json& numbers, std::size_t index) {
  if (!numbers.is_array() || numbers.size() != kFrameNumbers)
    return of_frame(index, "it is not a list of " + std::to_string(kFrameNumbers) + " numbers");
  Row row{};
  for (std::size_t i = 0; i < kFrameNumbers; ++i) {
    if (!numbers[i].is_number()) return of_frame(index, "entry " + std::to_string(i) + " is not a number");
    row[i] = numbers[i].get<double>();
    if (!std::isfinite(row[i])) return of_frame(index, "entry " + std::to_string(i) + " is not finite");
  }
  return row;
}

// Counts quaternions whose length is off by more than a hundredth. Key frames that were set by hand have such.
struct OffNorms {
  std::size_t count = 0;
  double worst = 1;

  void add(double norm) {
    if (std::abs(norm - 1) <= 0.01) return;
    ++count;
    if (std::abs(std::log(norm)) > std::abs(std::log(worst))) worst = norm;
  }
};

std::optional<Quat> read_rotation(const double* wxyz, OffNorms& off) {
  const Quat rotation(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  const double norm = rotation.norm();
  // A quaternion whose length is not near 1 is no rotation but damage.
  if (!(norm > 1e-3 && norm < 1e3)) return {};
  off.add(norm);
  return rotation.normalized();
}

Result<DeepMimicFrame> read_frame(const Row& row, std::size_t index, OffNorms& off) {
  DeepMimicFrame frame;
  frame.root = Vec3(row[1], row[2], row[3]);
  if (!(frame.root.cwiseAbs().maxCoeff() <= kCoordinateMax_m)) return of_frame(index, "the root is 10 km away");
  std::size_t at = 4;
  for (std::size_t j = 0; j < kDeepMimicJointCount; ++j) {
    if (is_hinge(static_cast<DeepMimicJoint>(j))) {
      frame.rotations[j] = Quat(Eigen::AngleAxisd(row[at], Vec3::UnitZ()));
      at += 1;
      continue;
    }
    const std::optional<Quat> rotation = read_rotation(&row[at], off);
    if (!rotation)
      return of_frame(index, "entries " + std::to_string(at) + " to " + std::to_string(at + 3) + " are no rotation");
    frame.rotations[j] = *rotation;
    at += 4;
  }
  return frame;
}

struct TimedFrame {
  double time_s;
  DeepMimicFrame frame;
};

Result<std::vector<TimedFrame>> read_frames(const json& list, OffNorms& off) {
  std::vector<TimedFrame> frames;
  double time_s = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Result<Row> row = read_row(list[i], i);
    if (!row) return Refusal(row.error());
    const Result<DeepMimicFrame> frame = read_frame(*row, i, off);
    if (!frame) return Refusal(frame.error());
    frames.push_back({time_s, *frame});
    // The duration of the last frame has no meaning.
    const double duration_s = row->front();
    const bool is_last = i + 1 == list.size();
    if (!is_last && !(duration_s > 0 && duration_s <= kFrameMax_s))
      return of_frame(i, "its duration is not in (0, 10] s");
    time_s += duration_s;
  }
  return frames;
}

DeepMimicFrame between(const DeepMimicFrame& a, const DeepMimicFrame& b, double s) {
  DeepMimicFrame out;
  out.root = a.root + s * (b.root - a.root);
  for (std::size_t j = 0; j < kDeepMimicJointCount; ++j)
    out.rotations[j] = a.rotations[j].slerp(s, b.rotations[j]).normalized();
  return out;
}

std::vector<DeepMimicFrame> resample(const std::vector<TimedFrame>& timed, double rate_hz) {
  // The 1e-3 adds the last step where only rounding keeps it out of the clip.
  const auto step_count = static_cast<std::size_t>(timed.back().time_s * rate_hz + 1e-3);
  std::vector<DeepMimicFrame> frames;
  frames.reserve(step_count + 1);
  std::size_t before = 0;
  for (std::size_t k = 0; k <= step_count; ++k) {
    const double time_s = static_cast<double>(k) / rate_hz;
    while (before + 1 < timed.size() && timed[before + 1].time_s <= time_s) ++before;
    if (before + 1 == timed.size()) {
      frames.push_back(timed.back().frame);
      continue;
    }
    const TimedFrame& a = timed[before];
    const TimedFrame& b = timed[before + 1];
    frames.push_back(between(a.frame, b.frame, (time_s - a.time_s) / (b.time_s - a.time_s)));
  }
  return frames;
}

}  // namespace

Result<DeepMimicClip> decode_deepmimic_clip(std::string_view text, double rate_hz) {
  const json clip = json::parse(text, nullptr, false);
  if (clip.is_discarded()) return Refusal("not JSON, or cut short");
  if (!clip.is_object() || !clip.contains("Frames") || !clip["Frames"].is_array() || clip["Frames"].empty())
    return Refusal("not a DeepMimic clip: it has no list of Frames");
  OffNorms off;
  const Result<std::vector<TimedFrame>> frames = read_frames(clip["Frames"], off);
  if (!frames) return Refusal(frames.error());
  DeepMimicClip out{rate_hz, resample(*frames, rate_hz), {}};
  if (off.count > 0) {
    char line[128];
    std::snprintf(line, sizeof line,
                  "%zu quaternions are not of unit length and are normalised; the worst norm is %.3g", off.count,
                  off.worst);
    out.warnings.emplace_back(line);
  }
  return out;
}

}  // namespace hairnet
