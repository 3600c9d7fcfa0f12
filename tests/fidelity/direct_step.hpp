#pragma once

#include <vector>

#include "core/levels/node_matrix.hpp"
#include "core/solver/reference_step.hpp"

namespace hairnet::fidelity {

// The step of reference_step.cpp with a direct solve: the system is assembled once a step as a sparse matrix and
// factored. Its cost depends little on the number of springs, so that tens of thousands are affordable.
class DirectStep {
 public:
  // Keeps a reference to `level`, which must outlive it.
  explicit DirectStep(const Level& level);

  // False when the system is not positive definite, or its solution not finite; the lattice is then worthless.
  [[nodiscard]] bool step(const StepInput& input, WorldLattice& lattice);

 private:
  void add_nodes(const StepInput& input, const WorldLattice& lattice);
  void add_springs(const StepInput& input, const WorldLattice& lattice);
  void add_attachments(const StepInput& input, const WorldLattice& lattice);
  void add_contacts(const StepInput& input, const WorldLattice& lattice);

  const Level& level_;
  std::vector<double> spring_weights_, attachment_weights_;
  // The matrix of the implicit step, M - h df/dp' - h^2 df/dp.
  NodeMatrix matrix_;
  // The right side of the system, h (f + h df/dp P').
  std::vector<Vec3> load_;
};

}  // namespace hairnet::fidelity
