#include "core/levels/knots.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// The mean of the tied points, head space, m.
Vec3 mean_of(std::span<const Vec3f> points_head, const Knot& knot) {
  HAIRNET_ASSERT(!knot.points.empty());
  HAIRNET_VALIDATE(std::ranges::max(knot.points) < points_head.size());
  Vec3 sum = Vec3::Zero();
  for (const std::uint32_t p : knot.points) sum += points_head[p].cast<double>();
  return sum / static_cast<double>(knot.points.size());
}

// Chooses the joints: the tied point farthest from the mean, and then again and again the one farthest from all that
// are chosen.
std::vector<Vec3> spread_joints(std::span<const Vec3f> points_head, const Knot& knot, const Vec3& mean) {
  // Points that are nearer to each other than this are one joint, m.
  constexpr double kApartMin = 1e-4;
  std::vector<double> distance(knot.points.size());
  const auto position = [&](std::size_t i) { return Vec3(points_head[knot.points[i]].cast<double>()); };
  for (std::size_t i = 0; i < distance.size(); ++i) distance[i] = (position(i) - mean).norm();
  std::vector<Vec3> joints;
  // All pairs of joints get a spring, so the number of joints is limited.
  while (joints.size() < std::min(kKnotJointsMax, knot.points.size())) {
    const auto farthest = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
    if (!joints.empty() && distance[farthest] < kApartMin) break;
    joints.push_back(position(farthest));
    for (std::size_t i = 0; i < distance.size(); ++i) {
      const double to_new = (position(i) - joints.back()).norm();
      distance[i] = joints.size() == 1 ? to_new : std::min(distance[i], to_new);
    }
  }
  HAIRNET_ASSERT(!joints.empty());
  HAIRNET_ASSERT(joints.size() <= kKnotJointsMax);
  return joints;
}

}  // namespace

void add_knot(const Grid& grid, std::span<const Vec3f> points_head, const Knot& knot, std::uint16_t group,
              StiffenerList& ties) {
  const Vec3 mean = mean_of(points_head, knot);
  std::vector<Vec3> joints = spread_joints(points_head, knot, mean);
  double extent = 0;
  for (const Vec3& joint : joints) extent = std::max(extent, (joint - mean).norm());
  // The four corners of a regular tetrahedron.
  for (const Vec3& corner : {Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)})
    joints.push_back(mean + 0.5 * extent * corner.normalized());
  HAIRNET_ASSERT(std::isfinite(extent));
  const SpringLaw law{static_cast<double>(knot.stiffness_n_per_m) / static_cast<double>(joints.size() - 1),
                      static_cast<double>(knot.damping_time_s), group};
  for (std::size_t a = 0; a < joints.size(); ++a) {
    for (std::size_t b = a + 1; b < joints.size(); ++b)
      add_spring(grid, grid.from_head(joints[a].cast<float>()), grid.from_head(joints[b].cast<float>()), law, ties);
  }
}

void add_knot_mass(const Grid& grid, std::span<const Vec3f> points_head, const Knot& knot, const Material& material,
                   LumpedHair& lumped) {
  HAIRNET_ASSERT(lumped.mass.size() == grid.node_count());
  if (!(knot.mass_kg > 0)) return;
  for (const auto& [node, weight] : grid.weights(grid.from_head(mean_of(points_head, knot).cast<float>()))) {
    const double mass = static_cast<double>(knot.mass_kg) * weight;
    // A node without hair has nothing to hang from, and takes the smallest length.
    const double hang_length = lumped.mass[node] > 0 ? lumped.hang_moment[node] / lumped.mass[node] : kHangLengthMin;
    add_mass(node, mass, hang_length, material, lumped);
  }
}

}  // namespace hairnet
