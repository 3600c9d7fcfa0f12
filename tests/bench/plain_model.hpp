#pragma once

#include <vector>

#include "core/solver/reference_step.hpp"
#include "tests/bench/baseline_step.hpp"

namespace hairnet::bench {

// A level in the baselines' plain numbers, for steps of one length and the material that it was built with times
// `material`.
class PlainModel {
 public:
  PlainModel(const Level& level, double step_s, const MaterialScale& material = {});
  PlainModel(const PlainModel&) = delete;
  PlainModel& operator=(const PlainModel&) = delete;

  [[nodiscard]] const PlainLevel& level() const { return plain_; }

 private:
  struct Terms {
    std::vector<double> weights, stiffness, damping, rest_length;
  };
  void take(const Stiffeners& stiffeners, double step_s, const MaterialScale& material, Terms& terms,
            PlainStiffeners& plain);

  std::vector<double> rest_, mass_, ether_stiffness_, ether_damping_, drag_;
  std::vector<PlainSkinDistanceField> skin_;
  Terms springs_, attachments_;
  PlainLevel plain_;
};

// A step's input in plain numbers, which point into it.
class PlainStep {
 public:
  // Asserts that the air is still.
  PlainStep(const Level& level, const StepInput& input);
  [[nodiscard]] PlainInput input() const;

 private:
  PlainInput input_;
  std::vector<PlainBone> bones_;
};

// The step of a baseline on a lattice of our own kind.
inline bool step(BaselineStep& baseline, const PlainStep& step, WorldLattice& lattice) {
  return baseline.step(step.input(), lattice.P.front().data(), lattice.P_dot.front().data());
}

}  // namespace hairnet::bench
