#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/mesh_query.hpp"
#include "core/groom/groom.hpp"

namespace hairnet::fidelity {

// The skin of a body in a pose, in head space. Only triangles near the hair are kept, so that a whole body costs no
// more than a bust, which is then open below. "Inside" means a winding number above one half. An open end shifts it a
// little, in the design as in motion: compare depths with those of the design.
class BentBody {
 public:
  explicit BentBody(const Groom& groom);

  void bend(const Pose& pose);  // `pose` may have the head anywhere

  // The farthest that skin within `reach_m` of the point went at the last bend, at most.
  [[nodiscard]] double moved_m(const Vec3f& point_head, double reach_m) const {
    return moved_box_.squaredExteriorDistance(point_head) < static_cast<float>(reach_m * reach_m) ? moved_m_ : 0;
  }
  // Of the point to the nearest skin, which must be nearer than `most_m`; in m.
  [[nodiscard]] double distance_m(const Vec3f& point_head,
                                  double most_m = std::numeric_limits<double>::infinity()) const {
    return skin_->closest(point_head.cast<double>(), most_m).distance;
  }
  [[nodiscard]] bool inside(const Vec3f& point_head) const { return skin_->inside(point_head.cast<double>()); }

 private:
  Body near_;  // the body near the hair
  std::vector<Vec3f> vertices_;
  std::optional<MeshQuery> skin_;
  Eigen::AlignedBox3f moved_box_;  // of what moved at the last bend, before and after it
  double moved_m_ = 0;             // the farthest that any vertex went
};

inline constexpr double kTooDeep_m = 0.003;  // beyond the depth in the design

// Finds the points of a character's hair that lie more than kTooDeep_m deeper than in the design. The mesh is queried
// only for points that, together with the skin, may have moved far enough since the last query; most points cost
// nothing.
class DeepPoints {
 public:
  // `body` must be bent as in the design.
  DeepPoints(const BentBody& body, std::span<const Vec3f> design);

  // As a share of all points, after each bend of the body.
  double share(const BentBody& body, std::span<const Vec3f> points);

 private:
  struct ProbePoint {
    double limit_m;          // the depth beyond which the point is too deep
    double distance_m;       // to the skin when the mesh was last asked, or the least that it can be
    bool is_inside;          // at that time; true while the side is not known
    bool is_side_known;      // the mesh was asked for the side too
    double travelled_m = 0;  // of point and skin since then, at most
    Vec3f last;              // where the point was at the last tick looked at
  };
  std::vector<ProbePoint> spots_;
};

}  // namespace hairnet::fidelity
