#pragma once

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "core/groom/material_scale.hpp"
#include "core/levels/level.hpp"
#include "core/solver/damping.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/spring.hpp"
#include "core/solver/step.hpp"
#include "core/solver/wind.hpp"

// A level's node values for a character with its own MaterialScale.
namespace hairnet {

inline float node_mass(const Level& level, const MaterialScale& material, std::size_t node) {
  return material.density * level.mass[node];
}

// The part from the build replaces the tension of hanging hair, so it scales with the hair's mass.
inline float ether_stiffness(const Level& level, const MaterialScale& material, std::size_t node) {
  return material.density * (level.ether_stiffness[node] + material.gel_per_s2 * level.mass[node]);
}

// The value for the solver (damping.hpp).
inline float ether_damping(const Level& level, const MaterialScale& material, std::size_t node, float step_s) {
  return solver_damping(ether_stiffness(level, material, node),
                        material.density * material.ether_damping * level.ether_damping[node], step_s);
}

inline Mat3f drag_tensor(const Level& level, const MaterialScale& material, std::size_t node) {
  const std::array<float, 6>& q = level.drag[node];
  Mat3f Q;
  Q << q[0], q[1], q[2], q[1], q[3], q[4], q[2], q[4], q[5];
  return material.air_drag * Q;
}

// k, and the q for the solver.
inline std::pair<float, float> stiffener_terms(const Stiffeners& stiffeners, const MaterialScale& material,
                                               std::size_t s, float step_s) {
  HAIRNET_ASSERT(s < stiffeners.count());
  const float k = material.stiffness * stiffeners.stiffness[s];
  return {k, solver_damping(k, material.damping * stiffeners.damping[s], step_s)};
}

// A spring of a given length in a step.
struct SpringTerms {
  double k, rest_length;
  // The slope dT/dx of the tension, N/m.
  double stiffness;
  // The damping that the solver uses (solver_damping).
  double q;
};
inline SpringTerms spring_terms(const Level& level, const StepInput& input, std::size_t s, double length) {
  HAIRNET_ASSERT(s < level.springs.count());
  HAIRNET_ASSERT(length > 0);
  const double k = double{input.material.stiffness} * double{level.springs.stiffness[s]};
  const double rest_length = level.springs.rest[s].cast<double>().norm();
  const double stiffness = spring_stiffness(k, rest_length, length - rest_length);
  const double q = double{input.material.damping} * double{level.springs.damping[s]};
  return {k, rest_length, stiffness, solver_damping(stiffness, q, input.step_s)};
}

// Air velocity at the nodes of a lattice at the end of a step, head axes, m/s.
class NodeWind {
 public:
  NodeWind(const Lattice& lattice, const StepInput& input) : lattice_(lattice) {
    HAIRNET_ASSERT(input.environment);
    const WindField& field = input.environment->wind;
    is_still_ = !field.acts();
    if (!is_still_) wind_ = wind_on(field, lattice, input.to.head(), input.time_s, HeadMotion(input).velocity());
  }
  [[nodiscard]] Vec3f at(std::uint32_t grid_node) const {
    HAIRNET_ASSERT(grid_node < lattice_.node_count());
    if (is_still_) return Vec3f::Zero();
    const auto [i, j, k] = lattice_.coordinates(grid_node);
    return wind_.at({fraction(i, 0), fraction(j, 1), fraction(k, 2)});
  }

 private:
  [[nodiscard]] float fraction(int coordinate, std::size_t axis) const {
    return static_cast<float>(coordinate) / static_cast<float>(lattice_.dims[axis] - 1);
  }
  const Lattice& lattice_;
  bool is_still_;
  LatticeWind wind_;
};

}  // namespace hairnet
