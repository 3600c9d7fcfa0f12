#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/pose/pose.hpp"
#include "core/skin/skin_distance_field.hpp"

namespace hairnet {

// A node of a skin's grid, as a texel.
struct SkinNode {
  // The distance to the skin, as skin_byte() has it.
  std::uint8_t distance;
  // The way as 128 + kSkinWaySteps * way. 0 0 0 means that nothing is pushed in the cells around the node.
  std::array<std::uint8_t, 3> way{0};
};
static_assert(sizeof(SkinNode) == 4);
inline constexpr float kSkinWaySteps = 89;

// The grid of one bone's skin.
struct SkinGrid {
  Bone bone = Bone::head;
  // The position of its first node, m.
  Vec3f origin = Vec3f::Zero();
  // The distance between two neighbouring nodes, m.
  float cell_m = 0;
  // The number of nodes along each axis.
  std::array<int, 3> dims{0, 0, 0};
  // The index of the grid's first node in SkinPush::nodes(); x is fastest, then y.
  std::uint32_t first = 0;
};

// Pushes deformed hair out of the skin: frames of coefficients lean hair into the body.
//
// Each point has a limit, like a contact point (core/levels/contact_points.hpp): how near to each bone's skin it may
// come. It is the hair's thickness, or less where the point is nearer in the design. Where the skin, moved with its
// bone, has the point nearer than that by m, the point moves by m times the *way*: the gradient g of the distance over
// g², a vector of which one metre makes the distance a metre greater. Ways of grid nodes are interpolated like
// distances, so the push is continuous in the pose and in the point. Deeper than kSkinDeepest_m no way is known, and
// the push fades out. A skin that its bone moves against the head pushes rooted hair by its root blend: roots stay.
// Hair at rest keeps its bits. Immutable; threads may share it.
class SkinPush {
 public:
  // A push goes over all bones this many times. With one time, two to four times as many points stay too deep.
  static constexpr int kTurns = 2;
  // In the design a point is this much farther away than its limit, so that rounding does not move it.
  static constexpr float kSlack_m = 1e-5f;
  // The push of other bones than the head is complete from this root blend on.
  static constexpr float kFullBlend = 0.25f;

  SkinPush(const Skin& skin, float thickness_m);

  // `rest`, `blend`: in the design, head space, and its root blend (empty: 1); `points`: after the FFD, one for each.
  void push(const Pose& pose, std::span<const Vec3f> rest, std::span<const float> blend, std::span<Vec3f> points) const;

  [[nodiscard]] std::span<const SkinGrid> grids() const { return grids_; }
  [[nodiscard]] std::span<const SkinNode> nodes() const { return nodes_; }
  [[nodiscard]] float thickness_m() const { return thickness_m_; }

 private:
  std::vector<SkinGrid> grids_;
  std::vector<SkinNode> nodes_;
  float thickness_m_;
};

}  // namespace hairnet
