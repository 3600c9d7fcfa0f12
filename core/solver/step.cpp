#include "core/solver/step.hpp"

#include <cassert>
#include <cmath>

#include "core/solver/contact.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/spring.hpp"

// The step solves eq. "(M - h df/dp' - h^2 df/dp) dP' = h (f + h df/dp P')" of model section 6 in other unknowns:
// y = P'_1 - R'P^0, the velocity at the end of the step beyond the rest's. Then the displacement at its end is
// d_1 = R d + h y, with R d the start's displacement turned into the new head axes ("carried"), and
//
//     A y = M (R v - R'P^0) + h f|_(y = 0),      A = M - h df/dp' - h^2 df/dp.
//
// Translation of the head has dropped out, and y = 0 is the rest motion, from which CG starts: at any number of
// iterations it then only lowers the energy of the linearised step from that of moving rigidly with the head.

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

Mat3f symmetric(const std::array<float, 6>& q) {
  Mat3f m;
  m << q[0], q[1], q[2], q[1], q[3], q[4], q[2], q[4], q[5];
  return m;
}

// Forces on single nodes at y = 0 into `load`, the nodes' own blocks of A into `diagonal`, inertia left out of `load`.
void add_node_forces(const Level& level, const HeadMotion& motion, float h, const StepScratch& s, std::span<Vec3f> load,
                     std::span<Mat3f> diagonal) {
  const Vec3f gravity_load = motion.gravity_load.cast<float>();
  const Vec3f wind = motion.wind.cast<float>();
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const Mat3f drag = symmetric(level.drag[i]);
    const float own = level.mass[i] + h * level.ether_damping[i] + h * h * level.ether_stiffness[i];
    diagonal[i] = own * Mat3f::Identity() + h * drag;
    load[i] =
        level.mass[i] * gravity_load - level.ether_stiffness[i] * s.carried[i] - drag * (s.rest_velocity[i] - wind);
  }
}

// Springs at y = 0 (eq. 3): the direction at the start of the step, the elongation there and its change by the rest
// motion over the step.
void add_springs(const Level& level, const HeadMotion& motion, float h, const LatticeState& state, StepScratch& s,
                 std::span<Vec3f> load) {
  const Stiffeners& springs = level.springs;
  const Mat3f turn = motion.turn.cast<float>();
  const Mat3f turn_less_identity = motion.turn_less_identity.cast<float>();
  for (std::size_t i = 0; i < springs.count(); ++i) {
    const Vec3f delta = weighted_sum(springs, i, state.displacement);
    const Vec3f eps = springs.rest[i] + delta;
    const float length = eps.norm();
    // A spring of no length has no direction, and no force until it has one.
    s.spring_direction[i] = length > 0 ? Vec3f(turn * (eps / length)) : Vec3f::Zero();
    const Vec3f& e = s.spring_direction[i];
    const float k = springs.stiffness[i], q = springs.damping[i];
    s.spring_coefficient[i] = h * (h * k + q);
    const Vec3f rest_motion = turn_less_identity * springs.rest[i] / -h;  // R' eps_0
    scatter(springs, i, -(k * elongation(springs.rest[i], delta) + (h * k + q) * e.dot(rest_motion)) * e, load);
  }
}

// Attachments at y = 0 (eq. 4).
void add_attachments(const Level& level, float h, StepScratch& s, std::span<Vec3f> load) {
  const Stiffeners& attachments = level.attachments;
  for (std::size_t i = 0; i < attachments.count(); ++i) {
    const float k = attachments.stiffness[i];
    s.attachment_coefficient[i] = h * (h * k + attachments.damping[i]);
    scatter(attachments, i, -k * weighted_sum(attachments, i, s.carried), load);
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

// Conjugate gradient from y = 0; `residual` holds the right-hand side on entry. False when the system is not finite.
bool solve(const Level& level, int iterations, StepScratch& s) {
  const std::size_t n = level.rest.size();
  for (std::size_t i = 0; i < n; ++i) {
    s.solution[i].setZero();
    s.preconditioned[i] = s.preconditioner[i] * s.residual[i];
    s.direction[i] = s.preconditioned[i];
  }
  double rho = dot(s.residual, s.preconditioned);
  const double enough = 1e-12 * rho;  // of float's own rounding: iterating on would only stir it
  for (int iteration = 0; iteration < iterations && rho > enough; ++iteration) {
    multiply(level, s, s.direction, s.product);
    const double curvature = dot(s.direction, s.product);
    if (!(curvature > 0)) break;
    const auto alpha = static_cast<float>(rho / curvature);
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
  return std::isfinite(rho);
}

}  // namespace

bool step(const Level& level, const StepInput& input, const SolverSettings& settings, StepScratch& scratch,
          LatticeState& state) {
  assert(state.displacement.size() == level.rest.size() && state.velocity.size() == level.rest.size());
  resize(scratch, level);
  const HeadMotion motion(input);
  const auto h = static_cast<float>(input.step_s);
  const Mat3f turn = motion.turn.cast<float>();
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    scratch.rest_velocity[i] = motion.rest_velocity(level.rest[i].cast<double>()).cast<float>();
    scratch.carried[i] = turn * state.displacement[i];
  }

  std::vector<Vec3f>& load = scratch.residual;
  add_node_forces(level, motion, h, scratch, load, scratch.diagonal);
  add_springs(level, motion, h, state, scratch, load);
  add_attachments(level, h, scratch, load);
  add_contacts(level, input, state, scratch.carried, load, scratch.diagonal);
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    load[i] = h * load[i] + level.mass[i] * (turn * state.velocity[i] - scratch.rest_velocity[i]);
  }

  precondition(level, scratch);
  const bool finite = solve(level, settings.iterations, scratch);
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    state.displacement[i] = scratch.carried[i] + h * scratch.solution[i];
    state.velocity[i] = scratch.rest_velocity[i] + scratch.solution[i];
  }
  return finite && is_sound(state);
}

void reset_to_rest(const Level& level, LatticeState& state) {
  state.displacement.assign(level.rest.size(), Vec3f::Zero());
  state.velocity.assign(level.rest.size(), Vec3f::Zero());
}

bool is_sound(const LatticeState& state) {
  for (std::size_t i = 0; i < state.displacement.size(); ++i) {
    // Written so that a NaN fails it.
    if (!(state.displacement[i].norm() <= kDisplacementMax_m) || !state.velocity[i].allFinite()) return false;
  }
  return true;
}

}  // namespace hairnet
