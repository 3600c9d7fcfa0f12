#include "client/assets/import/placement.hpp"

#include <array>
#include <cmath>

namespace hairnet {

Result<Axis> parse_axis(std::string_view text) {
  const bool minus = text.starts_with('-');
  if (minus || text.starts_with('+')) text.remove_prefix(1);
  constexpr std::string_view kLetters = "xyzXYZ";
  const std::size_t letter = text.size() == 1 ? kLetters.find(text.front()) : std::string_view::npos;
  if (letter == std::string_view::npos) return Refusal("an axis is one of +x -x +y -y +z -z");
  // The enumeration has the two directions of each axis side by side: 2 times the axis, and 1 more for minus.
  return static_cast<Axis>(2 * (letter % 3) + (minus ? 1 : 0));
}

std::string_view name_of(Axis axis) {
  constexpr std::array<std::string_view, 6> kNames{"+x", "-x", "+y", "-y", "+z", "-z"};
  return kNames[static_cast<std::size_t>(axis)];
}

Vec3 direction(Axis axis) {
  const auto index = static_cast<int>(axis);
  Vec3 out = Vec3::Zero();
  out[index / 2] = index % 2 == 0 ? 1 : -1;
  return out;
}

bool parallel(Axis a, Axis b) {
  return static_cast<int>(a) / 2 == static_cast<int>(b) / 2;
}

// Rows are the head's axes in the file's coordinates: its +X is up x face, as +Y x +Z is +X.
Mat3 rotation_to_head(Axis up, Axis face) {
  const Vec3 y = direction(up), z = direction(face);
  Mat3 rotation;
  rotation << y.cross(z).transpose(), y.transpose(), z.transpose();
  return rotation;
}

std::string validate(const Placement& placement) {
  if (parallel(placement.up, placement.face))
    return "up and face lie along the same axis: give --up and --face two axes, such as +z and +y";
  if (!(std::isfinite(placement.unit_m) && placement.unit_m > 0)) return "the unit is not a positive number of metres";
  if (placement.origin && !placement.origin->allFinite()) return "the origin is not finite";
  return {};
}

// The sum is computed in double, since files may lie far from their origin, where floats leave few digits for the hair.
Vec3f place(const Placement& placement, const Vec3& origin, const Vec3f& file_point) {
  const Mat3 rotation = rotation_to_head(placement.up, placement.face);
  return (placement.unit_m * (rotation * (file_point.cast<double>() - origin))).cast<float>();
}

}  // namespace hairnet
