#pragma once

#include <cstdint>
#include <vector>

#include "core/world/world.hpp"

namespace hairnet::support {

// Returns where the contact points of a character's hair are, in world space, in metres.
inline std::vector<Vec3> contact_places(const LatticeView& hair) {
  const ContactPoints& contacts = hair.model->contacts;
  std::vector<Vec3> places;
  for (std::uint32_t p = 0; p < contacts.count(); ++p) {
    Vec3f at = contacts.rest[p];
    for (std::uint32_t i = contacts.begin[p]; i < contacts.begin[p + 1]; ++i)
      at += contacts.weights[i] * hair.displacement[contacts.nodes[i]];
    places.push_back(hair.pose->head().point(at.cast<double>()));
  }
  return places;
}

}  // namespace hairnet::support
