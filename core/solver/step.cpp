#include "core/solver/step.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/solver/contact.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/node_terms.hpp"
#include "core/solver/spring.hpp"

// The step solves eq. "(M - h df/dp' - h^2 df/dp) dP' = h (f + h df/dp P')" of model section 6 in other unknowns:
// y = P'_1 - R'P^0, the velocity at the end of the step beyond the rest's. Then the displacement at its end is
// d_1 = R d + h y, with R d the start's displacement turned into the new head axes ("carried"), and
//
//     A y = b = M (R v - R'P^0) + h f|_(y = 0),      A = M - h df/dp' - h^2 df/dp.
//
// Translation of the head has dropped out, and y = 0 is the rest motion, from which CG starts. The error of CG is then
// orthogonal to y at every iteration (y.(A y - b) = 0), and from this follows that the linearised step never ends with
// more energy than it began with and was given from outside, at any number of iterations:
//
//     T_1 + V_1 = T_0 + V_0 + W - |y - y_0|^2_M / 2 - y.(h^2 K / 2 + h Q) y,     y_0 = R v - R'P^0.
//
// The springs' true energy at the end may be more than V_1, since they turn. hold_to_energy_limit sees
// to it that it is not by more than the step has dissipated.

namespace hairnet {
namespace {

void resize(StepScratch& s, const Level& level) {
  const std::size_t n = level.rest.size();
  for (auto* nodes :
       {&s.rest_velocity, &s.carried, &s.solution, &s.residual, &s.preconditioned, &s.direction, &s.product})
    nodes->resize(n);
  s.diagonal.resize(n);
  s.preconditioner.resize(n);
  s.spring_direction.resize(level.springs.count());
  s.spring_coefficient.resize(level.springs.count());
  s.spring_elongation.resize(level.springs.count());
  s.attachment_displacement.resize(level.attachments.count());
  s.attachment_coefficient.resize(level.attachments.count());
}

Vec3f weighted_sum(const Stiffeners& stiffeners, std::size_t s, std::span<const Vec3f> nodes) {
  Vec3f sum = Vec3f::Zero();
  for (std::uint32_t e = stiffeners.begin[s]; e < stiffeners.begin[s + 1]; ++e) {
    sum += stiffeners.weights[e] * nodes[stiffeners.nodes[e]];
  }
  return sum;
}

void scatter(const Stiffeners& stiffeners, std::size_t s, const Vec3f& sigma, std::span<Vec3f> nodes) {
  for (std::uint32_t e = stiffeners.begin[s]; e < stiffeners.begin[s + 1]; ++e) {
    nodes[stiffeners.nodes[e]] += stiffeners.weights[e] * sigma;
  }
}

void scatter_block(const Stiffeners& stiffeners, std::size_t s, const Mat3f& block, std::span<Mat3f> nodes) {
  for (std::uint32_t e = stiffeners.begin[s]; e < stiffeners.begin[s + 1]; ++e) {
    nodes[stiffeners.nodes[e]] += (stiffeners.weights[e] * stiffeners.weights[e]) * block;
  }
}

// Springs and attachments as they lie in head space: |eps| - |eps_0| with the direction of eps, and eps - eps_0.
void measure(const Level& level, const LatticeState& state, StepScratch& s) {
  for (std::size_t i = 0; i < level.springs.count(); ++i) {
    const Vec3f delta = weighted_sum(level.springs, i, state.displacement);
    const Vec3f eps = level.springs.rest[i] + delta;
    const float length = eps.norm();
    // A spring of no length has no direction, and no force until it has one.
    s.spring_direction[i] = length > 0 ? Vec3f(eps / length) : Vec3f::Zero();
    s.spring_elongation[i] = elongation(level.springs.rest[i], delta);
  }
  for (std::size_t i = 0; i < level.attachments.count(); ++i) {
    s.attachment_displacement[i] = weighted_sum(level.attachments, i, state.displacement);
  }
}

double half_square(float k, double x2) {
  return 0.5 * static_cast<double>(k) * x2;
}

// Of springs and attachments as measured, and of the ether.
double elastic_energy_j(const Level& level, const MaterialScale& material, const StepScratch& s,
                        const LatticeState& state) {
  double sum = 0;
  for (std::size_t i = 0; i < level.springs.count(); ++i) {
    const double elongation_m = s.spring_elongation[i];
    sum += half_square(material.stiffness * level.springs.stiffness[i], elongation_m * elongation_m);
  }
  for (std::size_t i = 0; i < level.attachments.count(); ++i) {
    sum += half_square(material.stiffness * level.attachments.stiffness[i], s.attachment_displacement[i].squaredNorm());
  }
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    sum += half_square(ether_stiffness(level, material, i), state.displacement[i].squaredNorm());
  }
  return sum;
}

// A lattice with more elastic energy than its last step may have left is drawn towards the design, where it has none,
// until it has not. In ordinary motion this hardly ever acts. The springs are measured for the step on return.
void hold_to_energy_limit(const Level& level, const MaterialScale& material, StepScratch& s, LatticeState& state) {
  constexpr double kRounding = 1e-3, kRounding_j = 1e-12, kDrawLeast = 0.5;
  constexpr int kDraws = 20;
  measure(level, state, s);
  const double most_j = double{state.elastic_energy_max_j} * (1 + kRounding) + kRounding_j;
  for (int draw = 1; draw <= kDraws; ++draw) {
    const double energy_j = elastic_energy_j(level, material, s, state);
    if (!(energy_j > most_j)) return;
    // Springs that have hardly turned have an energy that goes with the square of the displacement.
    const double by = draw < kDraws ? std::max(kDrawLeast, 0.999 * std::sqrt(most_j / energy_j)) : 0;
    for (Vec3f& d : state.displacement) d *= static_cast<float>(by);
    measure(level, state, s);
  }
}

// Forces on single nodes at y = 0 into `load`, the nodes' own blocks of A into `diagonal`, inertia left out of `load`.
void add_node_forces(const Level& level, const StepInput& input, const HeadMotion& motion, StepScratch& s,
                     std::span<Vec3f> load) {
  const auto h = static_cast<float>(input.step_s);
  const Vec3f gravity_load = motion.gravity_load.cast<float>();
  const NodeWind wind(level.geometry.lattice, input);
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const float m = node_mass(level, input.material, i);
    const float k = ether_stiffness(level, input.material, i), q = ether_damping(level, input.material, i, h);
    const Mat3f Q = drag_tensor(level, input.material, i);
    s.diagonal[i] = (m + h * (q + h * k)) * Mat3f::Identity() + h * Q;
    load[i] = m * gravity_load - k * s.carried[i] - Q * (s.rest_velocity[i] - wind.at(level.geometry.active_nodes[i]));
  }
}

// Springs at y = 0 (eq. 3): the direction at the start of the step, the elongation there and its change by the rest
// motion over the step.
void add_springs(const Level& level, const StepInput& input, const HeadMotion& motion, StepScratch& s,
                 std::span<Vec3f> load) {
  const auto h = static_cast<float>(input.step_s);
  const Stiffeners& springs = level.springs;
  const Mat3f turn = motion.turn.cast<float>();
  const Mat3f turn_less_identity = motion.turn_less_identity.cast<float>();
  for (std::size_t i = 0; i < springs.count(); ++i) {
    const auto [k, q] = stiffener_terms(springs, input.material, i, h);
    const Vec3f e = s.spring_direction[i] = turn * s.spring_direction[i];
    const float rest_rate = e.dot(turn_less_identity * springs.rest[i]) / -h;  // R' eps_0 . e
    scatter(springs, i, -(k * s.spring_elongation[i] + (h * k + q) * rest_rate) * e, load);
    s.spring_elongation[i] += h * rest_rate;
    s.spring_coefficient[i] = h * (h * k + q);
  }
}

// Attachments at y = 0 (eq. 4).
void add_attachments(const Level& level, const StepInput& input, const HeadMotion& motion, StepScratch& s,
                     std::span<Vec3f> load) {
  const auto h = static_cast<float>(input.step_s);
  const Stiffeners& attachments = level.attachments;
  const Mat3f turn = motion.turn.cast<float>();
  for (std::size_t i = 0; i < attachments.count(); ++i) {
    const auto [k, q] = stiffener_terms(attachments, input.material, i, h);
    scatter(attachments, i, -k * (turn * s.attachment_displacement[i]), load);
    s.attachment_coefficient[i] = h * (h * k + q);
  }
}

// Inverses of A's 3x3 diagonal blocks.
void precondition(const Level& level, StepScratch& s) {
  s.preconditioner = s.diagonal;
  for (std::size_t i = 0; i < level.springs.count(); ++i) {
    const Vec3f& e = s.spring_direction[i];
    scatter_block(level.springs, i, s.spring_coefficient[i] * e * e.transpose(), s.preconditioner);
  }
  for (std::size_t i = 0; i < level.attachments.count(); ++i) {
    scatter_block(level.attachments, i, s.attachment_coefficient[i] * Mat3f::Identity(), s.preconditioner);
  }
  for (Mat3f& block : s.preconditioner) block = block.inverse().eval();
}

// product = A direction, computed from the stiffeners: the matrix is never assembled (paper 2.2).
void multiply(const Level& level, const StepScratch& s, std::span<const Vec3f> direction, std::span<Vec3f> product) {
  for (std::size_t i = 0; i < direction.size(); ++i) product[i] = s.diagonal[i] * direction[i];
  for (std::size_t i = 0; i < level.springs.count(); ++i) {
    const Vec3f& e = s.spring_direction[i];
    scatter(level.springs, i, (s.spring_coefficient[i] * e.dot(weighted_sum(level.springs, i, direction))) * e,
            product);
  }
  for (std::size_t i = 0; i < level.attachments.count(); ++i) {
    scatter(level.attachments, i, s.attachment_coefficient[i] * weighted_sum(level.attachments, i, direction), product);
  }
}

double dot(std::span<const Vec3f> a, std::span<const Vec3f> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(a[i].dot(b[i]));
  return sum;
}

struct Solved {
  bool finite = false;
  double work = 0;  // y.b, J
};

// Conjugate gradient from y = 0; `residual` holds the right-hand side on entry.
Solved solve(const Level& level, int iterations, StepScratch& s) {
  const std::size_t n = level.rest.size();
  for (std::size_t i = 0; i < n; ++i) {
    s.solution[i].setZero();
    s.preconditioned[i] = s.preconditioner[i] * s.residual[i];
    s.direction[i] = s.preconditioned[i];
  }
  double rho = dot(s.residual, s.preconditioned), work = 0;
  const double enough = 1e-12 * rho;  // of float's own rounding: iterating on would only stir it
  for (int iteration = 0; iteration < iterations && rho > enough; ++iteration) {
    multiply(level, s, s.direction, s.product);
    const double curvature = dot(s.direction, s.product);
    if (!(curvature > 0)) break;
    const auto alpha = static_cast<float>(rho / curvature);
    work += static_cast<double>(alpha) * rho;  // b.direction = rho: what b has lost so far is conjugate to it
    for (std::size_t i = 0; i < n; ++i) {
      s.solution[i] += alpha * s.direction[i];
      s.residual[i] -= alpha * s.product[i];
      s.preconditioned[i] = s.preconditioner[i] * s.residual[i];
    }
    const double rho_next = dot(s.residual, s.preconditioned);
    const auto beta = static_cast<float>(rho_next / rho);
    rho = rho_next;
    for (std::size_t i = 0; i < n; ++i) s.direction[i] = s.preconditioned[i] + beta * s.direction[i];
  }
  return {std::isfinite(rho), work};
}

// Of the linearised step, at least: y.b of the solution is `work`. A viscosity is -h k / 3 or more (damping.hpp), so
// y.(h^2 K / 2 + h Q) y is no less than y.(h^2 K + h Q) y / 4, that is (y.b - |y|^2_M) / 4.
double dissipation_j(double work, double kinetic_end_j, double kinetic_change_j) {
  return kinetic_change_j + 0.25 * std::max(work - 2 * kinetic_end_j, 0.0);
}

// The state at the end of the step. False when it is not finite.
bool advance(const Level& level, const StepInput& input, const Mat3f& turn, double work, StepScratch& s,
             LatticeState& state) {
  const auto h = static_cast<float>(input.step_s);
  double kinetic_end_j = 0, kinetic_change_j = 0;
  float farthest_m = 0;
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const Vec3f& y = s.solution[i];
    const Vec3f y_0 = turn * state.velocity[i] - s.rest_velocity[i];
    const float m = node_mass(level, input.material, i);
    kinetic_end_j += half_square(m, y.squaredNorm());
    kinetic_change_j += half_square(m, (y - y_0).squaredNorm());
    state.displacement[i] = s.carried[i] + h * y;
    farthest_m = std::max(farthest_m, state.displacement[i].norm());
  }
  if (!std::isfinite(kinetic_end_j + kinetic_change_j) || !std::isfinite(farthest_m)) return false;

  for (std::size_t i = 0; i < level.springs.count(); ++i) {
    s.spring_elongation[i] += h * s.spring_direction[i].dot(weighted_sum(level.springs, i, s.solution));
  }
  for (std::size_t i = 0; i < level.attachments.count(); ++i) {
    s.attachment_displacement[i] = weighted_sum(level.attachments, i, state.displacement);
  }
  state.elastic_energy_max_j = static_cast<float>(elastic_energy_j(level, input.material, s, state) +
                                                  dissipation_j(work, kinetic_end_j, kinetic_change_j));

  // Drawn in as a whole, so that the hair keeps its shape.
  const float by = farthest_m > level.displacement_max_m ? level.displacement_max_m / farthest_m : 1;
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    state.displacement[i] *= by;
    state.velocity[i] = s.rest_velocity[i] + by * s.solution[i];
  }
  return true;
}

}  // namespace

int substep_count_for(double tick_s) {
  constexpr double kRounding = 1e-9;
  return std::max(1, static_cast<int>(std::ceil(tick_s / kStepMax_s - kRounding)));
}

bool step(const Level& level, const StepInput& input, const SolverSettings& settings, StepScratch& scratch,
          LatticeState& state) {
  assert(state.displacement.size() == level.rest.size() && state.velocity.size() == level.rest.size());
  resize(scratch, level);
  hold_to_energy_limit(level, input.material, scratch, state);

  const HeadMotion motion(input);
  const auto h = static_cast<float>(input.step_s);
  const Mat3f turn = motion.turn.cast<float>();
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    scratch.rest_velocity[i] = motion.rest_velocity(level.rest[i].cast<double>()).cast<float>();
    scratch.carried[i] = turn * state.displacement[i];
  }

  std::vector<Vec3f>& load = scratch.residual;
  add_node_forces(level, input, motion, scratch, load);
  add_springs(level, input, motion, scratch, load);
  add_attachments(level, input, motion, scratch, load);
  add_contacts(level, input, state, scratch.carried, load, scratch.diagonal);
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    load[i] = h * load[i] + node_mass(level, input.material, i) * (turn * state.velocity[i] - scratch.rest_velocity[i]);
  }

  precondition(level, scratch);
  const Solved solved = solve(level, settings.iterations, scratch);
  return solved.finite && advance(level, input, turn, solved.work, scratch, state);
}

void reset_to_rest(const Level& level, LatticeState& state) {
  state.displacement.assign(level.rest.size(), Vec3f::Zero());
  state.velocity.assign(level.rest.size(), Vec3f::Zero());
  state.elastic_energy_max_j = std::numeric_limits<float>::infinity();
}

LatticeEnergy energy(const Level& level, const MaterialScale& material, const HeadMotion& motion,
                     const LatticeState& state) {
  StepScratch scratch;
  resize(scratch, level);
  measure(level, state, scratch);
  LatticeEnergy sum{0, elastic_energy_j(level, material, scratch, state)};
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const Vec3f rest_velocity = motion.rest_velocity(level.rest[i].cast<double>()).cast<float>();
    sum.kinetic_j += half_square(node_mass(level, material, i), (state.velocity[i] - rest_velocity).squaredNorm());
  }
  return sum;
}

}  // namespace hairnet
