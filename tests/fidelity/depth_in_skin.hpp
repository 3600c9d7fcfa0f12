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
  // The distance to the nearest skin, m; infinite where none is within `max_m`.
  [[nodiscard]] double distance_m(const Vec3f& point_head,
                                  double max_m = std::numeric_limits<double>::infinity()) const {
    return skin_->closest(point_head.cast<double>(), max_m).distance;
  }
  [[nodiscard]] bool inside(const Vec3f& point_head) const { return skin_->inside(point_head.cast<double>()); }

 private:
  // The part of the body near the hair.
  Body near_;
  std::vector<Vec3f> vertices_;
  std::optional<MeshQuery> skin_;
  // Encloses what moved at the last bend, before and after it.
  Eigen::AlignedBox3f moved_box_;
  // The farthest that any vertex went at the last bend, m.
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

  // Returns the share of points that are too deep, 0 without points. Call it after each bend of the body.
  double share(const BentBody& body, std::span<const Vec3f> points);

 private:
  // A point, and what is known of it from the last query. Point and skin have come nearer by at most `travelled_m`
  // since then, so depth_m() is right to within that length.
  struct ProbePoint {
    // The depth beyond which the point is too deep.
    double limit_m;
    // The distance to the skin at the last query, or the least that it could be: the search ends a little beyond
    // limit_m.
    double distance_m;
    // Whether the point was in the body at the last query. It is true while the side is not known.
    bool is_inside;
    // Whether is_inside was found out. It was not where the point lay within limit_m of the skin, and so was not too
    // deep on either side.
    bool is_side_known;
    // An upper bound of how far point and skin have travelled since the last query.
    double travelled_m;
    // The place of the point at the last call of share().
    Vec3f last;

    [[nodiscard]] double depth_m() const { return is_inside ? distance_m : -distance_m; }
    [[nodiscard]] bool is_surely_within_limit() const { return depth_m() + travelled_m < limit_m; }
    [[nodiscard]] bool is_surely_too_deep() const { return is_side_known && depth_m() - travelled_m > limit_m; }
  };
  // Asks the mesh for the distance of the point, and for its side where the point may have gone through the skin.
  static void query(ProbePoint& probe, const BentBody& body);

  std::vector<ProbePoint> spots_;
};

}  // namespace hairnet::fidelity
