#pragma once

#include "tests/bench/subject.hpp"
#include "tests/fidelity/cut_off.hpp"

namespace hairnet::bench {

// The paper makes this many iterations of conjugate gradient in a step, without a preconditioner.
inline constexpr int kPaperIterations = 16;

// The error that comes from cutting the solver's iterations off: the distance of a trajectory from the one whose steps
// are solved to convergence, divided by the RMS motion, and averaged over the subject's motions.
class CutOffError {
 public:
  // `subject` and `level` must outlive it. Each frame of 1 / `rate_hz` is divided into `substeps` steps, and
  // `duration_s` of each motion is stepped. `stiffness` is a factor of the material's.
  CutOffError(const Subject& subject, const Level& level, double rate_hz, int substeps, double duration_s,
              float stiffness = 1);

  [[nodiscard]] double of_ours(int iterations) const;
  // Returns the error of the naive baseline. It is infinite when the trajectory diverges.
  [[nodiscard]] double of_naive(int iterations) const;
  // Returns the smallest number of our iterations whose error is at most `error`; `most` limits it.
  [[nodiscard]] int iterations_for(double error, int most) const;
  // Returns the same for the naive baseline. The result may be up to a quarter too large.
  [[nodiscard]] int naive_iterations_for(double error, int most) const;

 private:
  const Subject& subject_;
  const Level& level_;
  fidelity::CutOff setting_;
  double duration_s_;
  float stiffness_;
  // The converged trajectory of each motion.
  std::vector<fidelity::NodeTrajectory> converged_;
};

}  // namespace hairnet::bench
