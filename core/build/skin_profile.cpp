#include "core/build/skin_profile.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace hairnet {
namespace {

constexpr int kCells = 12;  // along an edge of a face
constexpr int kDirections = 6 * kCells * kCells;
constexpr double kSkinCone_rad = 0.44;

// From the centre to the skin: the outermost that the ball may reach, since a head has inner shells (mouth, eyes); so
// it is looked for from outside. Where there is none, other balls stand for the body.
double skin_distance(const MeshQuery& skin, const Vec3& centre, double radius, const Vec3& direction) {
  const double most = kSkinRatioMost * radius;
  const auto hit = skin.first_hit(centre + most * direction, -direction, most);
  return std::max(hit ? most - hit->distance : radius, kSkinRatioLeast * radius);
}

// Faces in the order +x, -x, +y, ...; a face's columns run along the next axis, its rows along the one after.
Vec3 direction_of(int cell) {
  const int column = cell % kCells, row = cell / kCells % kCells, face = cell / (kCells * kCells);
  const int axis = face / 2;
  Vec3 direction;
  direction[axis] = face % 2 == 0 ? 1 : -1;
  direction[(axis + 1) % 3] = 2 * (column + 0.5) / kCells - 1;
  direction[(axis + 2) % 3] = 2 * (row + 0.5) / kCells - 1;
  return direction.normalized();
}

}  // namespace

SkinProfile::SkinProfile(const MeshQuery& skin, const Vec3& centre, double radius) : distances_(kDirections) {
  std::vector<Vec3> directions;
  std::vector<float> skin_distances;
  for (int cell = 0; cell < kDirections; ++cell) {
    directions.push_back(direction_of(cell));
    skin_distances.push_back(static_cast<float>(skin_distance(skin, centre, radius, directions.back())));
  }
  const double cosine = std::cos(kSkinCone_rad);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    for (std::size_t j = 0; j < directions.size(); ++j) {
      if (directions[i].dot(directions[j]) >= cosine) distances_[i] = std::max(distances_[i], skin_distances[j]);
    }
  }
}

double SkinProfile::distance(const Vec3& direction) const {
  assert(!distances_.empty());
  int axis = 0;
  const double main = direction.cwiseAbs().maxCoeff(&axis);
  const int face = 2 * axis + (direction[axis] < 0 ? 1 : 0);
  const auto place = [&](int other) {
    return std::clamp(0.5 * (direction[(axis + other) % 3] / main + 1) * kCells - 0.5, 0.0, kCells - 1.0);
  };
  const double u = place(1), v = place(2);
  const int column = std::min(static_cast<int>(u), kCells - 2), row = std::min(static_cast<int>(v), kCells - 2);
  const double s = u - column, t = v - row;
  const float* at = distances_.data() + (face * kCells + row) * kCells + column;
  const auto mix = [](double share, float a, float b) {
    return (1 - share) * static_cast<double>(a) + share * static_cast<double>(b);
  };
  return (1 - t) * mix(s, at[0], at[1]) + t * mix(s, at[kCells], at[kCells + 1]);
}

}  // namespace hairnet
