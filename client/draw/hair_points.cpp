#include "client/draw/hair_points.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::draw {

HairPoints::HairPoints(std::shared_ptr<const Groom> groom, std::shared_ptr<const LevelGeometry> geometry,
                       std::shared_ptr<const Skin> skin)
    : groom_(std::move(groom)),
      geometry_(std::move(geometry)),
      blend_(root_blend(*groom_)),
      rest_tangents_(rest_tangents(*groom_, blend_)),
      lengths_(*groom_) {
  // FFD is quadratic at every distance: no drawing detail is chosen here.
  if (geometry_) deformer_.emplace(geometry_->lattice, groom_->points, blend_, rest_tangents_, FfdKind::quadratic);
  if (skin) push_.emplace(*skin, groom_->materials.base.thickness_m);
}

void HairPoints::place(const Pose& pose, const MovedLattice& lattice, std::span<Vec3f> points,
                       std::span<Vec3f> tangents) {
  HAIRNET_ASSERT(points.size() == groom_->points.size());
  HAIRNET_ASSERT(tangents.empty() || tangents.size() == points.size());
  if (lattice.geometry != nullptr) {
    HAIRNET_ASSERT(lattice.geometry == geometry_.get());
    const std::span<const Vec3f> nodes = nodes_of(lattice, nodes_);
    if (tangents.empty())
      deformer_->deform(nodes, points);
    else
      deformer_->deform(nodes, points, tangents);
  } else {
    std::ranges::copy(groom_->points, points.begin());
    std::ranges::copy(std::span(rest_tangents_.direction).first(tangents.size()), tangents.begin());
  }
  // The order matters: a push may lengthen a strand, and the limit keeps every point on its strand's curve, which the
  // push has taken out of the skin.
  if (push_) push_->push(pose, groom_->points, blend_, points);
  lengths_.limit(points);
  const RigidTransform& head = pose.head();
  // Doubles until the last moment: a head far from the origin would shake otherwise.
  for (Vec3f& point : points) point = head.point(point.cast<double>()).cast<float>();
  const Eigen::Matrix3f turn = head.rotation.toRotationMatrix().cast<float>();
  for (Vec3f& tangent : tangents) tangent = turn * tangent;
}

}  // namespace hairnet::draw
