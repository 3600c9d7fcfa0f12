#include "client/link/frame.hpp"

namespace hairnet::link {

void displacements_of(const Frame& frame, std::vector<Vec3f>& out) {
  out.resize(frame.basis ? frame.basis->hair.basis.node_count : 0);
  if (frame.basis) hairnet::displacements_of(frame.basis->hair.basis, frame.coefficients, out);
}

}  // namespace hairnet::link
