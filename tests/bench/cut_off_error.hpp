#pragma once

#include "tests/bench/subject.hpp"
#include "tests/fidelity/cut_off.hpp"

namespace hairnet::bench {

// How far trajectories on one level lie from those of the same steps solved to convergence, over the RMS motion, in the
// mean over the subject's motions.
class CutOffError {
 public:
  CutOffError(const Subject& subject, const Level& level, double rate_hz, int substeps, double duration_s,
              float stiffness = 1);

  [[nodiscard]] double of_ours(int iterations) const;
  // Is infinite when the step runs away.
  [[nodiscard]] double of_naive(int iterations) const;
  // The fewest of our iterations with an error of at most `error`, up to `most`.
  [[nodiscard]] int iterations_for(double error, int most) const;
  // Finds the same for the naive step, to a quarter.
  [[nodiscard]] int naive_iterations_for(double error, int most) const;

 private:
  const Subject& subject_;
  const Level& level_;
  fidelity::CutOff setting_;
  double duration_s_;
  float stiffness_;
  std::vector<fidelity::NodeTrajectory> converged_;  // one a motion
};

}  // namespace hairnet::bench
