#include "tests/fidelity/collisions_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hairnet::fidelity {
namespace {

constexpr float kReach_m = 0.25F;  // beyond the hair's box
constexpr double kCell_m = 0.008;
constexpr double kCornerOfCell_m = 0.87 * kCell_m;  // from its middle, and a little

Body near_hair(const Groom& groom) {
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
  for (const Vec3f& point : groom.points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Body& body = groom.body;
  std::vector<std::uint32_t> kept(body.mesh.vertices.size());
  Body near;
  for (std::size_t v = 0; v < kept.size(); ++v) {
    const Vec3f& vertex = body.mesh.vertices[v];
    const bool is_near = (vertex - low).minCoeff() > -kReach_m && (high - vertex).minCoeff() > -kReach_m;
    kept[v] = is_near ? static_cast<std::uint32_t>(near.mesh.vertices.size()) : ~0U;
    if (!is_near) continue;
    near.mesh.vertices.push_back(vertex);
    near.bone_weights.push_back(body.bone_weights[v]);
  }
  for (const auto& [a, b, c] : body.mesh.triangles) {
    if (kept[a] != ~0U && kept[b] != ~0U && kept[c] != ~0U) near.mesh.triangles.push_back({kept[a], kept[b], kept[c]});
  }
  return near;
}

std::vector<Bone> bones_of_triangles(const Body& body) {
  std::vector<Bone> bones;
  for (const auto& triangle : body.mesh.triangles) {
    std::array<float, kBoneCount> sum{};
    for (const std::uint32_t corner : triangle) {
      for (std::size_t b = 0; b < kBoneCount; ++b) sum[b] += body.bone_weights[corner][b];
    }
    bones.push_back(static_cast<Bone>(std::ranges::max_element(sum) - sum.begin()));
  }
  return bones;
}

}  // namespace

BodyDepth::BodyDepth(const Groom& groom) : near_(near_hair(groom)), bone_of_triangle_(bones_of_triangles(near_)) {
  bend({});
}

void BodyDepth::bend(const Pose& pose) {
  Pose in_head;
  for (std::size_t b = 0; b < kBoneCount; ++b) in_head.bones[b] = pose.head().inverse() * pose.bones[b];
  TriangleMesh bent{{}, near_.mesh.triangles};
  skin(near_, in_head, bent.vertices);
  skin_.emplace(bent);
  cells_.clear();
}

const BodyDepth::Cell& BodyDepth::cell_at(const Vec3& point) {
  std::uint64_t key = 0;
  Vec3 middle = Vec3::Zero();
  for (int a = 0; a < 3; ++a) {
    const double cell = std::floor(point[a] / kCell_m);
    middle[a] = (cell + 0.5) * kCell_m;
    key = key << 21 | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + (1 << 20));
  }
  const auto [entry, is_new] = cells_.try_emplace(key);
  Cell& cell = entry->second;
  if (is_new) {
    cell.near_skin = std::isfinite(skin_->closest(middle, kCornerOfCell_m).distance);
    if (!cell.near_skin) cell.inside = skin_->inside(middle);
  }
  return cell;
}

BodyDepth::Depth BodyDepth::at(const Vec3f& point_head) {
  const Vec3 point = point_head.cast<double>();
  const Cell& cell = cell_at(point);
  if (cell.near_skin ? !skin_->inside(point) : !cell.inside) return {};
  const MeshQuery::Closest closest = skin_->closest(point);
  return {closest.distance, bone_of_triangle_[closest.triangle]};
}

}  // namespace hairnet::fidelity
