#include "core/hair_cards/hair_volume.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet {
namespace {

using Cube = Eigen::Matrix<std::int64_t, 3, 1>;

Cube cube_at(const Vec3& point, double size_m) {
  HAIRNET_ASSERT(point.allFinite());
  return (point / size_m).array().floor().cast<std::int64_t>();
}

std::uint64_t key_of(const Cube& cube) {
  constexpr std::int64_t kHalf = 1 << 20;
  const auto part = [](std::int64_t i) {
    return static_cast<std::uint64_t>(std::clamp(i + kHalf, std::int64_t{0}, 2 * kHalf - 1));
  };
  return part(cube.x()) << 42 | part(cube.y()) << 21 | part(cube.z());
}

}  // namespace

HairVolume::HairVolume(std::span<const Centreline> centrelines) {
  for (const Centreline& centreline : centrelines) {
    for (const Vec3f& x : centreline.points) {
      Hair& hair = cubes_[key_of(cube_at(x.cast<double>(), kCube))];
      hair.sum += x.cast<double>();
      hair.count += 1;
    }
  }
}

Vec3 HairVolume::towards_surface(const Vec3& point) const {
  constexpr int kCubesMax = 2;  // from the point's own cube, in each direction
  const Cube middle = cube_at(point, kCube);
  Vec3 sum = Vec3::Zero();
  double weight_sum = 0;
  for (int x = -kCubesMax; x <= kCubesMax; ++x) {
    for (int y = -kCubesMax; y <= kCubesMax; ++y) {
      for (int z = -kCubesMax; z <= kCubesMax; ++z) {
        const auto found = cubes_.find(key_of(middle + Cube(x, y, z)));
        if (found == cubes_.end()) continue;
        const Vec3 offset = found->second.sum / found->second.count - point;
        const double near = std::max(0.0, 1 - offset.squaredNorm() / (kReach * kReach));
        const double weight = near * near * found->second.count;
        sum += weight * offset;
        weight_sum += weight;
      }
    }
  }
  HAIRNET_ASSERT(sum.norm() <= 1.001 * kReach * weight_sum);
  return weight_sum > 0 ? Vec3(-sum / (weight_sum * kReach)) : Vec3(Vec3::Zero());
}

}  // namespace hairnet
