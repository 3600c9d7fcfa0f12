#pragma once

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

  // The farthest that any vertex went at the last bend.
  [[nodiscard]] double moved_m() const { return moved_m_; }
  // Of the point above the nearest skin, in m; negative inside.
  [[nodiscard]] double height_m(const Vec3f& point_head) const;

 private:
  Body near_;  // the body near the hair
  std::vector<Vec3f> vertices_;
  std::optional<MeshQuery> skin_;
  double moved_m_ = 0;
};

inline constexpr double kTooDeep_m = 0.003;  // beyond the depth in the design

// Which points of one character's hair lie more than kTooDeep_m deeper than in the design. A point is asked for its
// height only when it and the skin have gone as far as it was from being too deep; so most points cost nothing.
class DeepPoints {
 public:
  // `body` must be bent as in the design.
  DeepPoints(const BentBody& body, std::span<const Vec3f> design);

  // As a share of all points, after each bend of the body.
  double share(const BentBody& body, std::span<const Vec3f> points);

 private:
  std::vector<double> limit_m_;   // the height below which a point is too deep
  std::vector<double> margin_m_;  // the least way to there
  std::vector<Vec3f> last_;
};

}  // namespace hairnet::fidelity
