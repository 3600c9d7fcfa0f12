#pragma once

#include "core/groom/fabric.hpp"
#include "core/levels/lumped_hair.hpp"
#include "core/levels/stiffener_list.hpp"

namespace hairnet {

// Treats a thread as one strand with the thread's own stiffness, density and drag. `material` adds what a thread does
// not define (ether, contact); its damping time is the thread's. Asserts that the thread has mass.
struct ThreadAsStrand {
  ThreadAsStrand(const Thread& thread, const Material& base, std::uint16_t group);
  StrandProperties properties;
  Material material;
};

}  // namespace hairnet
