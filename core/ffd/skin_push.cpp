#include "core/ffd/skin_push.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// The least g^2 by which a way is divided. Where the distance hardly changes, in the middle of a body, the way
// therefore shrinks to zero.
constexpr double kSlopeSquaredMin = 0.5;

// Computes the way of a node (SkinPush) by central differences of the distances that the bytes stand for; one-sided at
// the border.
std::array<std::uint8_t, 3> way_at(std::span<const SkinNode> nodes, const SkinGrid& grid,
                                   const std::array<int, 3>& at) {
  const std::array<int, 3> stride{1, grid.dims[0], grid.dims[0] * grid.dims[1]};
  const int own = at[0] + stride[1] * at[1] + stride[2] * at[2];
  std::array<double, 3> slope;
  double squared = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const int below = at[a] > 0 ? 1 : 0, above = at[a] + 1 < grid.dims[a] ? 1 : 0;
    const auto byte = [&](int steps) {
      return static_cast<int>(nodes[static_cast<std::size_t>(own + steps * stride[a])].distance);
    };
    slope[a] = (byte(above) - byte(-below)) * static_cast<double>(kSkinStep_m) /
               (static_cast<double>(grid.cell_m) * (above + below));
    squared += slope[a] * slope[a];
  }
  // The way is g / g^2, which the limit keeps finite.
  const double scale = static_cast<double>(kSkinWaySteps) / std::max(squared, kSlopeSquaredMin);
  std::array<std::uint8_t, 3> way;
  for (std::size_t a = 0; a < 3; ++a)
    way[a] = static_cast<std::uint8_t>(static_cast<int>(std::floor(128.5 + scale * slope[a])));
  return way;
}

// Computes the ways of those nodes whose cells may have points that are pushed. All other ways stay 0 0 0.
void set_ways(const SkinGrid& grid, float thickness_m, std::span<SkinNode> nodes) {
  // From this byte on a node is farther from the skin than the thickness. Half a step more lets rounding leave no
  // pushed point out.
  const float far_byte = std::ceil((thickness_m - kSkinDeepest_m) / kSkinStep_m + 0.5f);
  const auto [nx, ny, nz] = grid.dims;
  const auto around = [](int at, int nodes_an_axis, const auto& visit) {
    for (int n = std::max(at - 1, 0); n <= std::min(at + 1, nodes_an_axis - 1); ++n) visit(n);
  };
  std::size_t node = 0;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        if (static_cast<float>(nodes[node++].distance) >= far_byte) continue;
        around(k, nz, [&](int z) {
          around(j, ny, [&](int y) {
            around(i, nx, [&](int x) {
              auto& way = nodes[static_cast<std::size_t>(x + nx * (y + ny * z))].way;
              if (way[0] == 0) way = way_at(nodes, grid, {x, y, z});
            });
          });
        });
      }
    }
  }
}

// The distance and the way at a point, interpolated between nodes.
struct SkinSample {
  float distance_m;
  // The way times kSkinWaySteps.
  Vec3f way;
};

// Whether a point this far outside a grid is far from the skin: even beside the deepest node it is no nearer than the
// thickness.
bool is_far(float beyond_m, float thickness_m) {
  return beyond_m >= thickness_m - kSkinDeepest_m;
}

// One bone's skin, in the place that a pose gives it.
struct PlacedGrid {
  const SkinGrid* grid;
  const SkinNode* nodes;
  // The rotation from head space to the bone's rest space.
  Eigen::Matrix3f turn;
  Vec3f shift;
  float per_cell;  // 1/m
  float thickness_m;
  bool is_head;

  [[nodiscard]] Vec3f to_bone(const Vec3f& point) const { return is_head ? point : Vec3f(turn * point + shift); }

  // Interpolates the distance and the way at a point in the bone's rest space. False when no point there is pushed.
  bool sample(const Vec3f& point, SkinSample& sample) const {
    Vec3f t, beyond;
    std::array<int, 3> low;
    for (int a = 0; a < 3; ++a) {
      const int cells = grid->dims[static_cast<std::size_t>(a)] - 1;
      const float at = (point[a] - grid->origin[a]) * per_cell;
      const float within = std::clamp(at, 0.0f, static_cast<float>(cells));
      low[static_cast<std::size_t>(a)] = std::min(static_cast<int>(within), cells - 1);
      t[a] = within - static_cast<float>(low[static_cast<std::size_t>(a)]);
      beyond[a] = at - within;
    }
    const float beyond_m = beyond.norm() * grid->cell_m;
    if (is_far(beyond_m, thickness_m)) return false;
    const int row = grid->dims[0], layer = row * grid->dims[1];
    const SkinNode* const base = nodes + low[0] + row * low[1] + layer * low[2];
    // A way of 0 0 0 marks nodes around which nothing is pushed. Real ways never have a byte of 0: they are at least
    // 128 - kSkinWaySteps * sqrt 2.
    if (base->way[0] == 0) return false;
    float distance = 0;
    Vec3f way = Vec3f::Zero();
    for (int c = 0; c < 8; ++c) {
      const int i = c & 1, j = c >> 1 & 1, k = c >> 2;
      const float weight = (i ? t[0] : 1 - t[0]) * (j ? t[1] : 1 - t[1]) * (k ? t[2] : 1 - t[2]);
      const SkinNode& node = base[i + row * j + layer * k];
      distance += weight * static_cast<float>(node.distance);
      way += weight * Vec3f(static_cast<float>(node.way[0]) - 128, static_cast<float>(node.way[1]) - 128,
                            static_cast<float>(node.way[2]) - 128);
    }
    sample = {kSkinDeepest_m + kSkinStep_m * distance + beyond_m, way};
    return true;
  }

  // Pushes a point out of this skin. Returns whether it has moved.
  bool push(const Vec3f& rest, float blend, Vec3f& point) const {
    SkinSample now, design;
    if (!sample(to_bone(point), now) || now.distance_m >= thickness_m) return false;
    float limit_m = thickness_m;
    // Hair that lies nearer than its thickness in the design stays so, and hair at rest is not moved.
    if (sample(rest, design)) limit_m = std::min(limit_m, design.distance_m - SkinPush::kSlack_m);
    const float missing_m = limit_m - now.distance_m;
    if (!(missing_m > 0)) return false;
    const float share = is_head ? 1 : std::min(1.0f, blend / SkinPush::kFullBlend);
    const Vec3f by = (share * missing_m / kSkinWaySteps) * now.way;
    point += is_head ? by : Vec3f(turn.transpose() * by);
    return true;
  }
};

}  // namespace

SkinPush::SkinPush(const Skin& skin, float thickness_m) : thickness_m_(thickness_m) {
  HAIRNET_ASSERT(validate(skin).empty());
  HAIRNET_ASSERT(thickness_m >= 0);
  for (const SkinDistanceField& field : skin) {
    const auto first = static_cast<std::uint32_t>(nodes_.size());
    for (const float distance_m : field.distance) nodes_.push_back({skin_byte(distance_m)});
    grids_.push_back({field.bone, field.origin, field.cell_m, field.dims, first});
    set_ways(grids_.back(), thickness_m, std::span(nodes_).subspan(first));
  }
}

void SkinPush::push(const Pose& pose, std::span<const Vec3f> rest, std::span<const float> blend,
                    std::span<Vec3f> points) const {
  HAIRNET_ASSERT(rest.size() == points.size());
  HAIRNET_ASSERT(blend.empty() || blend.size() == points.size());
  std::array<PlacedGrid, kBoneCount> placed;
  for (std::size_t g = 0; g < grids_.size(); ++g) {
    const SkinGrid& grid = grids_[g];
    const RigidTransform to_bone = pose[grid.bone].inverse() * pose.head();
    placed[g] = {&grid,
                 nodes_.data() + grid.first,
                 to_bone.rotation.toRotationMatrix().cast<float>(),
                 to_bone.position.cast<float>(),
                 1 / grid.cell_m,
                 thickness_m_,
                 grid.bone == Bone::head};
  }
  const std::span<const PlacedGrid> all = std::span(placed).first(grids_.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (int turn = 0; turn < kTurns; ++turn) {
      bool is_moved = false;
      for (const PlacedGrid& grid : all) is_moved |= grid.push(rest[p], blend.empty() ? 1 : blend[p], points[p]);
      // A push out of one bone's skin may lead into another's, so kTurns is 2. Most points need no second turn.
      if (!is_moved) break;
    }
  }
}

}  // namespace hairnet
