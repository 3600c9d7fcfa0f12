#pragma once

#include "client/assets/made/style.hpp"

namespace hairnet::made {

// A place where hair is gathered: a ring of that radius about `centre`. `axis` must not be parallel to X, which `down`
// needs for its cross product.
struct Tie {
  Vec3 centre = Vec3::Zero();  // head space, m
  // A unit vector that leads out of the head.
  Vec3 axis = -Vec3::UnitZ();
  double radius_m = 0.0125;

  [[nodiscard]] Vec3 down() const { return axis.cross(Vec3::UnitX()).normalized(); }
  // The point at an angle about the axis from `down` towards +X.
  [[nodiscard]] Vec3 on_ring(double angle, double radius_m_at) const;
};

// Whether a root is pulled back to a tie: no root in front of the ears, because the hair would cross them.
bool is_pulled_back(const Vec3& root);

// A path along the scalp to the tie, like a taut thread; each strand has its own place in the tie. The path ends at the
// tie, a few millimetres along the axis, and follows the skin with a small lift.
Path pulled(const Root& root, const Tie& tie, Random& random);

// Adds a knot of the points in `tied`, which are already in the groom. A knot of fewer than two points ties nothing,
// and is left out.
void add_knot(Groom& groom, std::vector<std::uint32_t> tied, double stiffness_n_per_m);

}  // namespace hairnet::made
