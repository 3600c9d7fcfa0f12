#include "tests/bench/cut_off_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/bench/plain_model.hpp"

namespace hairnet::bench {
namespace {

// The trajectory of the hair when the naive step solves with so many iterations.
fidelity::NodeTrajectory follow_naive(const Level& level, const Motion& motion, const fidelity::CutOff& setting,
                                      float stiffness, double duration_s) {
  const fidelity::Clip clip = fidelity::make_clip(motion, setting.rate_hz, duration_s);
  MaterialScale material;
  material.stiffness = stiffness;
  const PlainModel model(level, 1 / setting.rate_hz / setting.substeps, material);
  const auto naive = make_naive_step(model.level(), {.iterations = setting.iterations});
  LatticeState rest;
  reset_to_rest(level, rest);
  RigidTransform head = clip.poses.front().head();
  WorldLattice lattice = to_world(level, head, rest);
  const fidelity::Stepper stepper{[&](const StepInput& input) {
                                    head = input.to.head();
                                    static_cast<void>(step(*naive, PlainStep(level, input), lattice));
                                  },
                                  [&] { return to_head(level, head, lattice).displacement; }};
  return fidelity::follow(stepper, clip, setting.substeps, stiffness);
}

}  // namespace

CutOffError::CutOffError(const Subject& subject, const Level& level, double rate_hz, int substeps, double duration_s,
                         float stiffness)
    : subject_(subject),
      level_(level),
      setting_{rate_hz, substeps, fidelity::kConverged},
      duration_s_(duration_s),
      stiffness_(stiffness) {
  for (const Motion& motion : subject.motions) {
    converged_.push_back(fidelity::integrate(level, motion, setting_, stiffness, duration_s));
  }
}

double CutOffError::of_ours(int iterations) const {
  double sum = 0;
  fidelity::CutOff setting = setting_;
  setting.iterations = iterations;
  for (std::size_t m = 0; m < converged_.size(); ++m) {
    const auto cut = fidelity::integrate(level_, subject_.motions[m], setting, stiffness_, duration_s_);
    sum += fidelity::relative_error(level_, cut, converged_[m]);
  }
  return sum / static_cast<double>(converged_.size());
}

double CutOffError::of_naive(int iterations) const {
  double sum = 0;
  fidelity::CutOff setting = setting_;
  setting.iterations = iterations;
  for (std::size_t m = 0; m < converged_.size(); ++m) {
    const auto cut = follow_naive(level_, subject_.motions[m], setting, stiffness_, duration_s_);
    sum += fidelity::relative_error(level_, cut, converged_[m]);
  }
  const double mean = sum / static_cast<double>(converged_.size());
  return std::isfinite(mean) ? mean : std::numeric_limits<double>::infinity();
}

int CutOffError::iterations_for(double error, int most) const {
  for (int iterations = 1; iterations < most; ++iterations) {
    if (of_ours(iterations) <= error) return iterations;
  }
  return most;
}

int CutOffError::naive_iterations_for(double error, int most) const {
  int iterations = kPaperIterations;
  // Each try steps whole motions, so the count grows by a quarter instead of by one.
  while (iterations < most && !(of_naive(iterations) <= error)) iterations += iterations / 4;
  return std::min(iterations, most);
}

}  // namespace hairnet::bench
