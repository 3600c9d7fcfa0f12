#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/mesh_query.hpp"
#include "core/groom/groom.hpp"

namespace hairnet::fidelity {

// The skin of a body that its bones move, in head space. Only the triangles within reach of the hair are kept, so that
// a whole body costs no more than a bust; the bust is then open below. Inside is where the winding number exceeds one
// half, which an open end shifts a little, in the design as in motion: depths are to be compared with the design's.
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

// Which points of one character's hair lie more than kTooDeep_m deeper than in the design. The mesh is asked about a
// point only when the point and the skin have gone as far as it was from being too deep; so most points cost nothing.
class DeepPoints {
 public:
  // `body` must be bent as in the design.
  DeepPoints(const BentBody& body, std::span<const Vec3f> design);

  // As a share of all points, after each bend of the body.
  double share(const BentBody& body, std::span<const Vec3f> points);

 private:
  struct Spot {
    double limit_m;          // the depth beyond which the point is too deep
    double distance_m;       // to the skin when the mesh was last asked, or the least that it can be
    bool is_inside;          // at that time; true while the side is not known
    bool is_side_known;      // the mesh was asked for the side too
    double travelled_m = 0;  // of point and skin since then, at most
    Vec3f last;              // where the point was at the last tick looked at
  };
  std::vector<Spot> spots_;
};

}  // namespace hairnet::fidelity
