#include "core/world/untangle.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/assert.hpp"
#include "core/ffd/bspline.hpp"

namespace hairnet {
namespace {

// Hair is untangled once the bones have been at rest for this long.
constexpr double kAfter_s = 1;
// Contact and springs fade out in this time, and fade in again as fast.
constexpr double kUntangle_s = 1;
// So often the lattice is tested for folds or, while it is being untangled, for having come back to its design.
constexpr double kLookEvery_s = 0.2;
// The factor of the stiffness is never zero, since ease_in in character.cpp scales the limit of elastic energy by the
// quotient of two factors.
constexpr double kStiffnessMin = 0.01;
// Hair is back in its design when every node is nearer to it than this.
constexpr float kHome_m = 0.002f;
// The most contact points that one test takes. A point costs six FFD evaluations, in a tick that other characters wait
// for.
constexpr std::size_t kPointsMax = 400;
// The step, in cells, to either side of a point, from which the gradient of the FFD is computed by differences.
constexpr float kDifference = 0.05f;

// A body counts as upright when the head is tilted by at most kTilt_rad (5 degrees), and no bone is turned by more than
// kTurn_rad (10 degrees) or shifted by more than kShift_m against the head. No hair presses into the skin of such a
// body, so the hair is safe without contact.
constexpr double kTurn_rad = 0.17, kTilt_rad = 0.087, kShift_m = 0.02;

bool is_upright(const Pose& pose) {
  static const double kTurnCosine = std::cos(kTurn_rad / 2), kTiltCosine = std::cos(kTilt_rad);
  if (pose.head().vector(Vec3::UnitY()).y() < kTiltCosine) return false;
  return std::ranges::all_of(pose.bones, [&](const RigidTransform& bone) {
    // The bone's origin at rest is that of the head joint.
    return std::abs(bone.rotation.dot(pose.head().rotation)) >= kTurnCosine &&
           (bone.position - pose.head().position).squaredNorm() <= kShift_m * kShift_m;
  });
}

// Where the FFD moves a point of the design, for displacements of all grid nodes.
Vec3f moved(const Lattice& lattice, std::span<const Vec3f> grid, const Vec3f& point) {
  Vec3f at = point;
  HAIRNET_VALIDATE(grid.size() == lattice.node_count());
  for (const auto& [node, weight] : quadratic_ffd_weights(lattice, point)) at += weight * grid[node];
  return at;
}

bool is_home(std::span<const Vec3f> displacement) {
  return std::ranges::all_of(displacement, [](const Vec3f& d) { return d.squaredNorm() < kHome_m * kHome_m; });
}

}  // namespace

bool is_folded(const Level& level, std::span<const Vec3f> displacement) {
  HAIRNET_ASSERT(displacement.size() == level.rest.size());
  const Lattice& lattice = level.geometry.lattice;
  // The buffer stays with the thread, so that later ticks allocate nothing.
  thread_local std::vector<Vec3f> grid;
  grid.resize(lattice.node_count());
  expand_displacements(level.geometry, displacement, grid);
  const std::size_t stride = level.contacts.count() / kPointsMax + 1;
  for (std::size_t p = 0; p < level.contacts.count(); p += stride) {
    Mat3f gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3f step = kDifference * lattice.spacing[axis] * Vec3f::Unit(axis);
      // The columns are not divided by the step, since a positive factor does not change the sign of the determinant.
      gradient.col(axis) =
          moved(lattice, grid, level.contacts.rest[p] + step) - moved(lattice, grid, level.contacts.rest[p] - step);
    }
    if (gradient.determinant() < 0) return true;
  }
  return false;
}

void Untangle::update(const Pose& pose, double still_s, double elapsed_s, const Level& level,
                      std::span<const Vec3f> displacement) {
  HAIRNET_ASSERT(still_s >= 0);
  HAIRNET_ASSERT(elapsed_s > 0);
  HAIRNET_ASSERT(displacement.size() == level.rest.size());
  since_look_s_ += elapsed_s;
  if (still_s < kAfter_s || !is_upright(pose)) {
    is_tangled_ = false;
  } else if (since_look_s_ >= kLookEvery_s) {
    since_look_s_ = 0;
    // Untangling that has begun goes on until the hair is back in its design, even if the lattice has unfolded on the
    // way.
    is_tangled_ = is_tangled_ ? !is_home(displacement) : is_folded(level, displacement);
  }
  share_ = std::clamp(share_ + (is_tangled_ ? elapsed_s : -elapsed_s) / kUntangle_s, 0.0, 1.0);
}

double Untangle::stiffness() const {
  return std::max(kStiffnessMin, 1 - share_);
}

}  // namespace hairnet
