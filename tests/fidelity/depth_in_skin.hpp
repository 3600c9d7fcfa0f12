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

  // Moves the skin into the pose, which may have the head anywhere.
  void bend(const Pose& pose);

  // The farthest that skin within `reach_m` of the point went at the last bend, at most.
  [[nodiscard]] double moved_m(const Vec3f& point_head, double reach_m) const {
    return moved_box_.squaredExteriorDistance(point_head) < static_cast<float>(reach_m * reach_m) ? moved_m_ : 0;
  }
  // Measures to the nearest skin, which must be nearer than `max_m`; in m.
  [[nodiscard]] double distance_m(const Vec3f& point_head,
                                  double max_m = std::numeric_limits<double>::infinity()) const {
    return skin_->closest(point_head.cast<double>(), max_m).distance;
  }
  [[nodiscard]] bool inside(const Vec3f& point_head) const { return skin_->inside(point_head.cast<double>()); }

 private:
  // Is the part of the body near the hair.
  Body near_;
  std::vector<Vec3f> vertices_;
  std::optional<MeshQuery> skin_;
  // Encloses what moved at the last bend, before and after it.
  Eigen::AlignedBox3f moved_box_;
  // Is the farthest that any vertex went.
  double moved_m_ = 0;
};

// A point is too deep when it is so much deeper than in the design.
inline constexpr double kTooDeep_m = 0.003;

// Finds the points of a character's hair that lie more than kTooDeep_m deeper than in the design. The mesh is queried
// only for points that, together with the skin, may have moved far enough since the last query; most points cost
// nothing.
class DeepPoints {
 public:
  // `body` must be bent as in the design.
  DeepPoints(const BentBody& body, std::span<const Vec3f> design);

  // Returns the share of points that are too deep. Call it after each bend of the body.
  double share(const BentBody& body, std::span<const Vec3f> points);

 private:
  struct ProbePoint {
    // Is the depth beyond which the point is too deep.
    double limit_m;
    // Is the distance to the skin when the mesh was last asked, or the least that it can be.
    double distance_m;
    // Says whether the point was in the body at that query. It is true while the side is not known.
    bool is_inside;
    // Is true when the mesh was asked for the side too.
    bool is_side_known;
    // Bounds how far point and skin have travelled since then.
    double travelled_m = 0;
    // Is where the point was at the last tick looked at.
    Vec3f last;
  };
  std::vector<ProbePoint> spots_;
};

}  // namespace hairnet::fidelity
