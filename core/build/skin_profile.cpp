#include "core/build/skin_profile.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace hairnet {
namespace {

double env(const char* n, double d) { const char* v = std::getenv(n); return v ? std::atof(v) : d; }
constexpr int kSize = 12;  // cells along an edge of a face

// From the centre to the skin: the outermost that the ball may reach, since a head has inner shells (mouth, eyes).
// Looked for from outside. Where there is none, other balls stand for the body.
double skin_distance(const MeshQuery& skin, const BodyBall& ball, const Vec3& direction) {
  const double most = kRadiusRatioMost * ball.radius;
  const auto hit = skin.first_hit(ball.centre + most * direction, -direction, most);
  return std::max(hit ? most - hit->distance : ball.radius, kRadiusRatioLeast * ball.radius);
}

Vec3 direction_of(int face, double u, double v) {
  const int axis = face / 2;
  Vec3 d;
  d[axis] = face % 2 ? -1 : 1;
  d[(axis + 1) % 3] = u;
  d[(axis + 2) % 3] = v;
  return d.normalized();
}

Vec3 direction_of_cell(int index) {
  const int column = index % kSize, row = index / kSize % kSize, face = index / (kSize * kSize);
  return direction_of(face, 2 * (column + 0.5) / kSize - 1, 2 * (row + 0.5) / kSize - 1);
}

}  // namespace

SkinProfile::SkinProfile(const MeshQuery& skin, const BodyBall& ball) {
  for (int i = 0; i < 6 * kSize * kSize; ++i) {
    distances_.push_back(static_cast<float>(skin_distance(skin, ball, direction_of_cell(i))));
  }
  widen();
}

void SkinProfile::widen() {
  std::vector<Vec3> directions;
  for (int i = 0; i < 6 * kSize * kSize; ++i) directions.push_back(direction_of_cell(i));
  const double cosine = std::cos(env("HN_CONE", 0) * 0.01745);
  const double quantile = env("HN_Q", 0.75);
  std::vector<float> widened(distances_.size()), near;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    near.clear();
    for (std::size_t j = 0; j < directions.size(); ++j) {
      if (directions[i].dot(directions[j]) >= cosine) near.push_back(distances_[j]);
    }
    if (near.empty()) near.push_back(distances_[i]);
    const auto nth = near.begin() + static_cast<std::ptrdiff_t>(quantile * static_cast<double>(near.size() - 1));
    std::ranges::nth_element(near, nth);
    widened[i] = std::max(distances_[i], *nth);
  }
  distances_ = widened;
}

double SkinProfile::distance(const Vec3& direction) const {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const double main = std::abs(direction[axis]);
  const int face = 2 * axis + (direction[axis] < 0 ? 1 : 0);
  const auto place = [&](int a) {
    return std::clamp(0.5 * (direction[(axis + a) % 3] / main + 1) * kSize - 0.5, 0.0, kSize - 1.0);
  };
  const double u = place(1), v = place(2);
  const int column = std::min(static_cast<int>(u), kSize - 2), row = std::min(static_cast<int>(v), kSize - 2);
  const double s = u - column, t = v - row;
  const auto at = [&](int r, int c) { return static_cast<double>(distances_[static_cast<std::size_t>((face * kSize + r) * kSize + c)]); };
  return (1 - t) * ((1 - s) * at(row, column) + s * at(row, column + 1)) +
         t * ((1 - s) * at(row + 1, column) + s * at(row + 1, column + 1));
}

}  // namespace hairnet
