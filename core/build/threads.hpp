#pragma once

#include "core/build/node_shares.hpp"
#include "core/build/stiffener_list.hpp"
#include "core/groom/fabric.hpp"

namespace hairnet {

// A thread on the lattice is a strand of another stuff: one "hair" with the thread's own stiffness, weight and drag.
// `material` has what the thread does not state itself (ether, contact); its damping time is the thread's own.
struct ThreadAsStrand {
  ThreadAsStrand(const Thread& thread, const Material& base, std::uint16_t group);
  StrandProperties properties;
  Material material;
};

}  // namespace hairnet
