#pragma once

#include "client/assets/made/style.hpp"

namespace hairnet::made {

// A place where hair is gathered: a ring of that radius about `centre`.
struct Tie {
  Vec3 centre = Vec3::Zero();  // head space, m
  Vec3 axis = -Vec3::UnitZ();  // out of the head, unit
  double radius_m = 0.0125;

  [[nodiscard]] Vec3 down() const { return axis.cross(Vec3::UnitX()).normalized(); }
  // At an angle about the axis from `down` towards +X.
  [[nodiscard]] Vec3 on_ring(double angle, double radius_m_at) const;
};

// Roots that are pulled back to a tie: none before the ears, which hair would have to cross.
bool is_pulled_back(const Vec3& root);

// Along the scalp to the tie, as a taut thread would lie, each strand to its own place in it.
Path pulled(const Root& root, const Tie& tie, Random& random);

// A knot of the points that `tied` names, all in the groom already.
void add_knot(Groom& groom, std::vector<std::uint32_t> tied, double stiffness_n_per_m);

}  // namespace hairnet::made
