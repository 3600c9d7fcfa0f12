#include "tests/fidelity/holding_depth.hpp"

#include <algorithm>
#include <limits>

namespace hairnet::fidelity {
namespace {

constexpr float kReach_m = 0.25F;  // beyond the hair's box

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

}  // namespace

BentBody::BentBody(const Groom& groom) : near_(near_hair(groom)), vertices_(near_.mesh.vertices), skin_(near_.mesh) {}

void BentBody::bend(const Pose& pose) {
  Pose in_head;
  for (std::size_t b = 0; b < kBoneCount; ++b) in_head.bones[b] = pose.head().inverse() * pose.bones[b];
  TriangleMesh bent{{}, near_.mesh.triangles};
  skin(near_, in_head, bent.vertices);
  float moved_m = 0;
  for (std::size_t v = 0; v < vertices_.size(); ++v)
    moved_m = std::max(moved_m, (bent.vertices[v] - vertices_[v]).norm());
  constexpr float kRounding_m = 1e-5F;  // of a body that goes with the head
  moved_m_ = 0;
  if (moved_m < kRounding_m) return;
  moved_m_ = static_cast<double>(moved_m);
  skin_.emplace(bent);
  vertices_ = std::move(bent.vertices);
}

double BentBody::height_m(const Vec3f& point_head) const {
  const Vec3 point = point_head.cast<double>();
  const double distance_m = skin_->closest(point).distance;
  return skin_->inside(point) ? -distance_m : distance_m;
}

DeepPoints::DeepPoints(const BentBody& body, std::span<const Vec3f> design) : last_(design.begin(), design.end()) {
  for (const Vec3f& point : design) {
    const double height_m = body.height_m(point);
    limit_m_.push_back(std::min(0.0, height_m) - kTooDeep_m);
    margin_m_.push_back(height_m - limit_m_.back());
  }
}

double DeepPoints::share(const BentBody& body, std::span<const Vec3f> points) {
  std::size_t count = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    margin_m_[p] -= static_cast<double>((points[p] - last_[p]).norm()) + body.moved_m();
    last_[p] = points[p];
    if (margin_m_[p] > 0) continue;
    margin_m_[p] = body.height_m(points[p]) - limit_m_[p];
    if (margin_m_[p] < 0) ++count;
  }
  return static_cast<double>(count) / static_cast<double>(points.size());
}

}  // namespace hairnet::fidelity
