#include "client/viewer/characters/place.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "client/assets/import/parse_text.hpp"
#include "core/shown_text.hpp"

namespace hairnet::viewer {
namespace {

// Characters stand further apart than their shoulders are wide, so that their bodies do not meet.
constexpr double kApart_m = 0.7, kRowsApart_m = 0.9;
constexpr std::size_t kRowMax = 8;
// The limit for each number of a place. It is well within the protocol's limit for a pose.
constexpr double kFar_m = 1000;

}  // namespace

Result<Place> parse_place(std::string_view text) {
  std::array<double, 3> numbers{};
  std::size_t count = 0;
  // A fourth number is refused like a wrong one: count ends at 0.
  for (std::size_t begin = 0; begin <= text.size() && count <= 3; ++count) {
    const std::size_t end = std::min(text.find(':', begin), text.size());
    const auto number = parse_number<double>(text.substr(begin, end - begin));
    if (!number || count == 3 || std::abs(*number) > kFar_m) {
      count = 0;
      break;
    }
    numbers[count] = *number;
    begin = end + 1;
  }
  if (count < 2)
    return Refusal("place '" + shown(text) + "' is not X:Z or X:Z:HEADING in metres and degrees, each within 1000");
  return Place{numbers[0], numbers[1], numbers[2]};
}

Place side_by_side(std::size_t n, std::size_t count) {
  const std::size_t row = n / kRowMax, first = row * kRowMax;
  const std::size_t in_row = std::min(kRowMax, count - first);
  return {kApart_m * (static_cast<double>(n - first) - (static_cast<double>(in_row) - 1) / 2),
          // Rows go away from the default camera, which looks along -Z.
          -kRowsApart_m * static_cast<double>(row), 0};
}

Pose placed(const Place& place, const Pose& pose) {
  const RigidTransform move{Quat(Eigen::AngleAxisd(place.heading_deg * std::numbers::pi / 180, Vec3::UnitY())),
                            Vec3(place.x_m, 0, place.z_m)};
  Pose there = pose;
  for (RigidTransform& bone : there.bones) bone = move * bone;
  return there;
}

void move_to(const Place& place, Motion& motion) {
  // No place changes nothing, to the bit.
  if (place == Place{}) return;
  for (Pose& pose : motion.poses) pose = placed(place, pose);
}

}  // namespace hairnet::viewer
