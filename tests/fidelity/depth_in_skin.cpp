#include "tests/fidelity/depth_in_skin.hpp"

#include <algorithm>
#include <limits>

namespace hairnet::fidelity {
namespace {

// Skin within this distance of the hair's box is measured.
constexpr float kReach_m = 0.25F;

// The part of the body within kReach_m of the box around the hair. A triangle is kept when all three of its vertices
// are.
Body near_hair(const Groom& groom) {
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
  for (const Vec3f& point : groom.points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Body& body = groom.body;
  // The new number of each vertex; ~0U: it is left out.
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

// Hair lives in head space, so the body is bent relative to the head: a pose with the head elsewhere must not move the
// skin.
void BentBody::bend(const Pose& pose) {
  Pose in_head;
  for (std::size_t b = 0; b < kBoneCount; ++b) in_head.bones[b] = pose.head().inverse() * pose.bones[b];
  TriangleMesh bent{{}, near_.mesh.triangles};
  skin_vertices(near_, in_head, bent.vertices);
  // Skin that goes with the head moves less than this in head space.
  constexpr float kRounding_m = 1e-6F;
  std::vector<float> vertex_m(vertices_.size());
  for (std::size_t v = 0; v < vertices_.size(); ++v) vertex_m[v] = (bent.vertices[v] - vertices_[v]).norm();
  const float moved_m = vertex_m.empty() ? 0 : std::ranges::max(vertex_m);
  moved_box_.setEmpty();
  for (const auto& triangle : bent.triangles) {
    if (std::ranges::all_of(triangle, [&](std::uint32_t v) { return vertex_m[v] < kRounding_m; })) continue;
    for (const std::uint32_t v : triangle) moved_box_.extend(vertices_[v]).extend(bent.vertices[v]);
  }
  moved_m_ = static_cast<double>(moved_m);
  if (moved_m < kRounding_m) return;
  skin_.emplace(bent);
  vertices_ = std::move(bent.vertices);
}

DeepPoints::DeepPoints(const BentBody& body, std::span<const Vec3f> design) {
  for (const Vec3f& point : design) {
    const double distance_m = body.distance_m(point);
    const bool is_inside = body.inside(point);
    spots_.push_back({.limit_m = kTooDeep_m + (is_inside ? distance_m : 0),
                      .distance_m = distance_m,
                      .is_inside = is_inside,
                      .is_side_known = true,
                      .travelled_m = 0,
                      .last = point});
  }
}

void DeepPoints::query(ProbePoint& probe, const BentBody& body) {
  constexpr double kRounding_m = 1e-5;
  // The search for the nearest skin ends this far beyond the limit: a longer distance costs more to find than it saves.
  constexpr double kFar_m = 0.02;
  const bool may_have_crossed = probe.travelled_m >= probe.distance_m || !probe.is_side_known;
  const double max_m = std::min(probe.distance_m + probe.travelled_m + kRounding_m, probe.limit_m + kFar_m);
  probe.distance_m = std::min(max_m, body.distance_m(probe.last, max_m));
  probe.travelled_m = 0;
  // Within the limit of the skin a point is not too deep on either side.
  probe.is_side_known = !may_have_crossed || probe.distance_m > probe.limit_m;
  if (may_have_crossed) probe.is_inside = !probe.is_side_known || body.inside(probe.last);
}

double DeepPoints::share(const BentBody& body, std::span<const Vec3f> points) {
  if (points.empty()) return 0;
  std::size_t count = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    ProbePoint& probe = spots_[p];
    // The point and the skin can have come nearer by at most what both have travelled.
    probe.travelled_m += static_cast<double>((points[p] - probe.last).norm());
    probe.travelled_m += body.moved_m(points[p], probe.distance_m + probe.travelled_m);
    probe.last = points[p];
    if (!probe.is_surely_within_limit() && !probe.is_surely_too_deep()) query(probe, body);
    if (probe.is_inside && probe.distance_m > probe.limit_m) ++count;
  }
  return static_cast<double>(count) / static_cast<double>(points.size());
}

}  // namespace hairnet::fidelity
