#pragma once

#include <vector>

#include "core/solver/reference_step.hpp"
#include "tests/bench/baseline_step.hpp"

namespace hairnet::bench {

// A level in the plain numbers of the baselines (baseline_step.hpp), for steps of one length. `material` multiplies the
// material that the level was built with.
class PlainModel {
 public:
  // `level` must outlive it.
  PlainModel(const Level& level, double step_s, const MaterialScale& material = {});
  PlainModel(const PlainModel&) = delete;
  PlainModel& operator=(const PlainModel&) = delete;

  [[nodiscard]] const PlainLevel& level() const { return plain_; }

 private:
  // The numbers of all springs, or of all attachments, to which PlainStiffeners points.
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

// The input of a step in plain numbers. What input() returns points into this object.
class PlainStep {
 public:
  // Asserts that the air is still, since the baselines know no wind.
  PlainStep(const Level& level, const StepInput& input);
  [[nodiscard]] PlainInput input() const;

 private:
  PlainInput input_;
  std::vector<PlainBone> bones_;
};

// Makes a step of a baseline on a lattice of core/solver. Returns false when the result is not finite.
inline bool step(BaselineStep& baseline, const PlainStep& step, WorldLattice& lattice) {
  return baseline.step(step.input(), lattice.P.front().data(), lattice.P_dot.front().data());
}

}  // namespace hairnet::bench
