#include "core/levels/make_skin.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/assert.hpp"
#include "core/geometry/mesh_query.hpp"

namespace hairnet {
namespace {

// A bone carries the triangles for which its mean weight at the three corners is at least this. It is less than a half,
// so two bones carry the triangles in between, and their skins overlap at the joint.
constexpr double kShareMin = 0.35;
// Skin farther from the hair's box than this is left out, since hair does not touch it.
constexpr float kReach_m = 0.15f;
// The grid extends this far beyond the skin, on each side.
constexpr double kMargin_m = 0.03;
// The smallest distance between two nodes of a grid; large bones get larger cells (grid_around).
constexpr double kCellMin_m = 0.008;
// About the most nodes of one bone's grid; rounding up the nodes of each axis adds a few.
constexpr double kNodesMax = 24'000;
// Where another bone's skin is nearer than the bone's own, the depth falls by this many metres for each metre that the
// own skin is farther away.
constexpr double kEndSlope = 2;
// Distances are cut off here, as no code needs greater ones.
constexpr double kSearch_m = 0.08;

struct Box {
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::infinity()), high = -low;

  void add(const Vec3f& point) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  [[nodiscard]] bool is_empty() const { return !(low.x() <= high.x()); }
  [[nodiscard]] bool holds(const Vec3f& p) const { return (p - low).minCoeff() >= 0 && (high - p).minCoeff() >= 0; }
};

// The box about all hair, with kReach_m on each side.
Box reach_of(const Groom& groom) {
  Box box;
  for (const Vec3f& point : groom.points) box.add(point);
  box.low.array() -= kReach_m;
  box.high.array() += kReach_m;
  return box;
}

// The bone's mean weight at the corners of a triangle.
double share_of(const Body& body, const std::array<std::uint32_t, 3>& triangle, std::size_t bone) {
  HAIRNET_ASSERT(bone < kBoneCount);
  HAIRNET_VALIDATE(std::ranges::max(triangle) < body.bone_weights.size());
  double sum = 0;
  for (const std::uint32_t corner : triangle) sum += static_cast<double>(body.bone_weights[corner][bone]);
  return sum / 3;
}

// The skin that one bone carries, within reach, and the box around it.
struct Part {
  Part(const Body& body, std::size_t bone, const Box& reach) : carried(body.mesh.triangles.size()) {
    // All vertices are kept, so triangles keep their indices; MeshQuery copies those that it needs.
    mesh.vertices = body.mesh.vertices;
    for (std::size_t t = 0; t < carried.size(); ++t) {
      const auto& triangle = body.mesh.triangles[t];
      carried[t] = share_of(body, triangle, bone) >= kShareMin;
      const bool is_near =
          std::ranges::any_of(triangle, [&](std::uint32_t v) { return reach.holds(mesh.vertices[v]); });
      if (!carried[t] || !is_near) continue;
      mesh.triangles.push_back(triangle);
      for (const std::uint32_t v : triangle) box.add(mesh.vertices[v].cwiseMax(reach.low).cwiseMin(reach.high));
    }
  }
  TriangleMesh mesh;
  // Whether the bone carries each of the body's triangles.
  std::vector<bool> carried;
  Box box;
};

// A grid for the skin in this box, without its distances.
SkinDistanceField grid_around(const Box& box, Bone bone) {
  HAIRNET_ASSERT(!box.is_empty());
  const Vec3 size = (box.high - box.low).cast<double>() + Vec3::Constant(2 * kMargin_m);
  // A large body gets larger cells and not more of them, which bounds the memory of every client.
  const double cell = std::max(kCellMin_m, std::cbrt(size.prod() / kNodesMax));
  SkinDistanceField field;
  field.bone = bone;
  field.cell_m = static_cast<float>(cell);
  field.origin = box.low - Vec3f::Constant(static_cast<float>(kMargin_m));
  for (std::size_t a = 0; a < 3; ++a) {
    field.dims[a] = static_cast<int>(std::ceil(size[static_cast<Eigen::Index>(a)] / cell)) + 1;
  }
  HAIRNET_ASSERT(std::ranges::min(field.dims) >= 2);
  HAIRNET_ASSERT(field.origin.allFinite());
  return field;
}

// Computes the distances of a row of the grid along x, negative inside. A node is tested for being inside only where
// the skin may lie between it and the node before.
void fill_row(const MeshQuery& body, const MeshQuery& part, const std::vector<bool>& carried, SkinDistanceField& field,
              int j, int k) {
  HAIRNET_ASSERT(j >= 0 && k >= 0);
  HAIRNET_ASSERT(std::cmp_equal(field.distance.size(), field.dims[0] * (j + field.dims[1] * k)));
  const double cell = static_cast<double>(field.cell_m);
  double last_m = 0;
  bool inside = false;
  for (int i = 0; i < field.dims[0]; ++i) {
    const Vec3 at = field.origin.cast<double>() + cell * Vec3(i, j, k);
    const MeshQuery::Closest nearest = body.closest(at, kSearch_m);
    const double whole_m = std::min(nearest.distance, kSearch_m);
    // The whole body tells the side, since the skin of a single bone is open.
    if (!(last_m > cell)) inside = body.inside(at);
    last_m = whole_m;
    // Below skin that another bone carries, this bone's part of the body ends; the further away its own skin is, the
    // sooner it ends.
    HAIRNET_VALIDATE(nearest.triangle < carried.size());
    const bool is_own = !std::isfinite(nearest.distance) || carried[nearest.triangle];
    const double own_m = is_own ? whole_m : std::min(part.closest(at, kSearch_m).distance, kSearch_m);
    const double depth_m = whole_m - kEndSlope * (own_m - whole_m);
    field.distance.push_back(static_cast<float>(inside ? std::min(-depth_m, own_m) : own_m));
  }
}

// Returns none when the bone carries no skin within reach, or when `keep_going` says no.
std::optional<SkinDistanceField> make_field(const Body& body, const MeshQuery& whole, Bone bone, const Box& reach,
                                            const std::function<bool()>& keep_going) {
  const Part part(body, static_cast<std::size_t>(bone), reach);
  if (part.mesh.triangles.empty() || part.box.is_empty()) return std::nullopt;
  const MeshQuery skin(part.mesh);
  SkinDistanceField field = grid_around(part.box, bone);
  for (int k = 0; k < field.dims[2]; ++k) {
    for (int j = 0; j < field.dims[1]; ++j) {
      if (!keep_going()) return std::nullopt;
      fill_row(whole, skin, part.carried, field, j, k);
    }
  }
  HAIRNET_ASSERT(std::cmp_equal(field.distance.size(), field.dims[0] * field.dims[1] * field.dims[2]));
  HAIRNET_VALIDATE(std::ranges::all_of(field.distance, [](float distance) { return std::isfinite(distance); }));
  return field;
}

}  // namespace

std::shared_ptr<const Skin> make_skin(const Groom& groom, const ParallelFor& parallel_for,
                                      const std::function<bool()>& keep_going) {
  HAIRNET_ASSERT(groom.body.bone_weights.size() == groom.body.mesh.vertices.size());
  const MeshQuery whole(groom.body.mesh);
  const Box reach = reach_of(groom);
  std::array<std::optional<SkinDistanceField>, kBoneCount> fields;
  std::atomic<bool> is_cancelled = false;
  const auto goes_on = [&] {
    if (keep_going && !is_cancelled && !keep_going()) is_cancelled = true;
    return !is_cancelled;
  };
  if (!whole.empty() && !groom.points.empty()) {
    run_loop(parallel_for, kBoneCount,
             [&](std::size_t b) { fields[b] = make_field(groom.body, whole, static_cast<Bone>(b), reach, goes_on); });
  }
  if (is_cancelled) return nullptr;
  auto skin = std::make_shared<Skin>();
  // Fields are collected in the order of the bones, whichever thread was first.
  for (std::optional<SkinDistanceField>& field : fields) {
    if (field) skin->push_back(std::move(*field));
  }
  return skin;
}

}  // namespace hairnet
