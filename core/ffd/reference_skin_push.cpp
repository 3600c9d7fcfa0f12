#include "core/ffd/reference_skin_push.hpp"

#include <algorithm>

namespace hairnet {
namespace {

struct PreciseSample {
  double distance_m = 0;
  Vec3 way = Vec3::Zero();
};

// Trilinear; outside the grid what is at its nearest point, and the distance from there.
PreciseSample sample(const SkinPush& skin, const SkinGrid& grid, const Vec3& point) {
  const Vec3 cells(grid.dims[0] - 1, grid.dims[1] - 1, grid.dims[2] - 1);
  const Vec3 at = (point - grid.origin.cast<double>()) / static_cast<double>(grid.cell_m);
  const Vec3 within = at.cwiseMax(Vec3::Zero()).cwiseMin(cells);
  const Eigen::Vector3i low = within.cwiseMin(cells - Vec3::Ones()).cast<int>();
  const Vec3 t = within - low.cast<double>();
  PreciseSample sum;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 2; ++i) {
        const double weight = (i ? t.x() : 1 - t.x()) * (j ? t.y() : 1 - t.y()) * (k ? t.z() : 1 - t.z());
        const int entry = low.x() + i + grid.dims[0] * (low.y() + j + grid.dims[1] * (low.z() + k));
        const SkinNode& node = skin.nodes()[grid.first + static_cast<std::size_t>(entry)];
        sum.distance_m += weight * static_cast<double>(distance_of_skin_byte(node.distance));
        sum.way += weight * (Vec3(node.way[0], node.way[1], node.way[2]) - Vec3::Constant(128)) /
                   static_cast<double>(kSkinWaySteps);
      }
    }
  }
  sum.distance_m += static_cast<double>(grid.cell_m) * (at - within).norm();
  return sum;
}

}  // namespace

Vec3 reference_skin_push(const SkinPush& skin, const Pose& pose, const Vec3& rest, double blend, const Vec3& point) {
  Vec3 pushed = point;
  for (int turn = 0; turn < SkinPush::kTurns; ++turn) {
    for (const SkinGrid& grid : skin.grids()) {
      const RigidTransform to_bone =
          grid.bone == Bone::head ? RigidTransform{} : pose[grid.bone].inverse() * pose.head();
      const PreciseSample now = sample(skin, grid, to_bone.point(pushed));
      // At rest all bones are equal, so the design's place is the same in every bone's axes.
      const double design_m = sample(skin, grid, rest).distance_m - static_cast<double>(SkinPush::kSlack_m);
      const double missing_m = std::min(static_cast<double>(skin.thickness_m()), design_m) - now.distance_m;
      const double share =
          grid.bone == Bone::head ? 1 : std::min(1.0, blend / static_cast<double>(SkinPush::kFullBlend));
      if (missing_m > 0) pushed += share * missing_m * to_bone.inverse().vector(now.way);
    }
  }
  return pushed;
}

}  // namespace hairnet
