#include "core/solver/reference_step.hpp"

#include <cmath>
#include <span>

#include "core/assert.hpp"
#include "core/solver/body_contact_list.hpp"
#include "core/solver/contact_list.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/node_terms.hpp"
#include "core/solver/spring.hpp"
#include "core/solver/weighted_sum.hpp"

namespace hairnet {
namespace {

// A stiffener's law linearised at some epsilon: sigma, d sigma / d eps and d sigma / d eps' (eqs. 1-2).
struct Linearised {
  const Stiffeners* stiffeners;
  std::size_t index;
  Mat3 d_eps, d_eps_dot;
};

// Held points as attachments: their weighted sums, and where they are bound to.
Stiffeners held_points(const ContactPoints& points, std::span<const StepHold> holds) {
  Stiffeners held;
  for (const StepHold& hold : holds) {
    HAIRNET_ASSERT(hold.point < points.count());
    for (std::uint32_t e = points.begin[hold.point]; e < points.begin[hold.point + 1]; ++e) {
      held.nodes.push_back(points.nodes[e]);
      held.weights.push_back(points.weights[e]);
    }
    held.begin.push_back(static_cast<std::uint32_t>(held.nodes.size()));
    held.stiffness.push_back(static_cast<float>(kHoldStiffness_n_per_m));
  }
  return held;
}

// The linearised forces of a step.
struct System {
  // The forces on nodes.
  std::vector<Vec3> f;
  // The derivatives of forces on single nodes, which are block diagonal.
  std::vector<Mat3> df_dp, df_dp_dot;
  // All other forces act through weighted sums.
  std::vector<Linearised> stiffeners;
};

void add_springs(const Level& level, const StepInput& input, const WorldLattice& lattice, System& system) {
  const Stiffeners& springs = level.springs;
  for (std::size_t s = 0; s < springs.count(); ++s) {
    const Vec3 eps = weighted_sum(springs, s, lattice.P), eps_dot = weighted_sum(springs, s, lattice.P_dot);
    // A spring without length has no direction and exerts no force until it has one; step_inl.hpp does the same.
    if (!(eps.norm() > 0)) continue;
    const SpringTerms spring = spring_terms(level, input, s, eps.norm());
    scatter(springs, s, spring_force(spring.k, spring.q, spring.rest_length, eps, eps_dot), system.f);
    system.stiffeners.push_back({&springs, s, spring_jacobian(spring.stiffness, eps), spring_jacobian(spring.q, eps)});
  }
}

void add_attachments(const Level& level, const StepInput& input, const std::vector<Vec3>& rest,
                     const std::vector<Vec3>& rest_dot, const WorldLattice& lattice, System& system) {
  const Stiffeners& attachments = level.attachments;
  for (std::size_t s = 0; s < attachments.count(); ++s) {
    const auto [k, q] = stiffener_terms(attachments, input.material, s, static_cast<float>(input.step_s));
    const Vec3 eps = weighted_sum(attachments, s, lattice.P), eps_dot = weighted_sum(attachments, s, lattice.P_dot);
    const Vec3 eps_0 = weighted_sum(attachments, s, rest), eps_0_dot = weighted_sum(attachments, s, rest_dot);  // eq. 5
    scatter(attachments, s, -double{k} * (eps - eps_0) - double{q} * (eps_dot - eps_0_dot), system.f);          // eq. 4
    system.stiffeners.push_back({&attachments, s, -double{k} * Mat3::Identity(), -double{q} * Mat3::Identity()});
  }
}

void add_node_forces(const Level& level, const StepInput& input, const std::vector<Vec3>& rest,
                     const std::vector<Vec3>& rest_dot, const WorldLattice& lattice, System& system) {
  const Mat3 R = input.to.head().rotation.toRotationMatrix();
  const NodeWind wind(level.geometry.lattice, input);
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const double m = node_mass(level, input.material, i), k = ether_stiffness(level, input.material, i),
                 q = ether_damping(level, input.material, i, static_cast<float>(input.step_s));
    // Drag tensors (paper eq. 6) and the wind at nodes are in head axes, and this step is in world axes.
    const Mat3 Q = R * drag_tensor(level, input.material, i).cast<double>() * R.transpose();
    const Vec3 u = R * wind.at(level.geometry.active_nodes[i]).cast<double>();
    system.f[i] += -k * (lattice.P[i] - rest[i]) - q * (lattice.P_dot[i] - rest_dot[i]) +
                   m * (input.environment->gravity - R * kDesignGravity) - Q * (lattice.P_dot[i] - u);
    system.df_dp[i] -= k * Mat3::Identity();
    system.df_dp_dot[i] -= q * Mat3::Identity() + Q;
  }
}

// A contact's stiffness acts on the motion of its nodes relative to their rest. The force that is added is that of the
// linearisation at P, so the formula of the step stays the paper's.
void add_contacts(const Level& level, const StepInput& input, const std::vector<Vec3>& rest_dot,
                  const WorldLattice& lattice, System& system) {
  const ContactPoints& points = level.contacts;
  for (const Contact& contact : find_contacts(level, input, lattice)) {
    const Mat3 K = -contact.stiffness * contact.normal * contact.normal.transpose();
    for (std::uint32_t e = points.begin[contact.point]; e < points.begin[contact.point + 1]; ++e) {
      const std::size_t i = points.nodes[e];
      const double weight = double{points.weights[e]};
      system.f[i] += weight * (contact.force * contact.normal - input.step_s * K * rest_dot[i]);
      system.df_dp[i] += weight * K;
    }
  }
}

// Does what add_contacts does, with a full 3x3 stiffness, as friction acts along the surface as well.
void add_bodies(const Level& level, const StepInput& input, const std::vector<Vec3>& rest_dot,
                const WorldLattice& lattice, System& system) {
  const ContactPoints& points = level.contacts;
  for (const BodyContact& contact : find_body_contacts(level, input, lattice)) {
    for (std::uint32_t e = points.begin[contact.point]; e < points.begin[contact.point + 1]; ++e) {
      const std::size_t i = points.nodes[e];
      const double weight = double{points.weights[e]};
      system.f[i] += weight * (contact.force + input.step_s * contact.stiffness * rest_dot[i]);
      system.df_dp[i] -= weight * contact.stiffness;
    }
  }
}

// Adds eq. 4 of each held point. epsilon_0 is the place to which the point is bound, minus the place where it would be
// at rest.
void add_holds(const Level& level, const StepInput& input, const Stiffeners& held, const std::vector<Vec3>& rest,
               const std::vector<Vec3>& rest_dot, const WorldLattice& lattice, System& system) {
  const double k = kHoldStiffness_n_per_m, h = input.step_s, q = h * k;
  for (std::size_t s = 0; s < held.count(); ++s) {
    const StepHold& hold = input.touch->holds[s];
    const Vec3 at_rest = level.contacts.rest[hold.point].cast<double>();
    const Vec3 before = input.from.head().point(at_rest), after = input.to.head().point(at_rest);
    const Vec3 eps = weighted_sum(held, s, lattice.P) - weighted_sum(held, s, rest);
    const Vec3 eps_dot = weighted_sum(held, s, lattice.P_dot) - weighted_sum(held, s, rest_dot);
    const Vec3 eps_0 = hold.to - after, eps_0_dot = (hold.to - hold.from - (after - before)) / h;
    scatter(held, s, -k * (eps - eps_0) - q * (eps_dot - eps_0_dot), system.f);
    system.stiffeners.push_back({&held, s, -k * Mat3::Identity(), -q * Mat3::Identity()});
  }
}

// a df/dp' x + b df/dp x, never assembled (paper 2.2)
std::vector<Vec3> multiply(const System& system, double a, double b, const std::vector<Vec3>& x) {
  HAIRNET_ASSERT(x.size() == system.df_dp.size());
  std::vector<Vec3> out(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = (a * system.df_dp_dot[i] + b * system.df_dp[i]) * x[i];
  for (const Linearised& s : system.stiffeners) {
    scatter(*s.stiffeners, s.index, (a * s.d_eps_dot + b * s.d_eps) * weighted_sum(*s.stiffeners, s.index, x), out);
  }
  return out;
}

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  HAIRNET_ASSERT(a.size() == b.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

}  // namespace

WorldLattice to_world(const Level& level, const RigidTransform& head, const LatticeState& state) {
  HAIRNET_ASSERT(state.displacement.size() == level.rest.size());
  HAIRNET_ASSERT(state.velocity.size() == level.rest.size());
  WorldLattice lattice;
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    lattice.P.push_back(head.point(level.rest[i].cast<double>() + state.displacement[i].cast<double>()));
    lattice.P_dot.push_back(head.vector(state.velocity[i].cast<double>()));
  }
  return lattice;
}

LatticeState to_head(const Level& level, const RigidTransform& head, const WorldLattice& lattice) {
  HAIRNET_ASSERT(lattice.P.size() == level.rest.size());
  HAIRNET_ASSERT(lattice.P_dot.size() == level.rest.size());
  const RigidTransform back = head.inverse();
  LatticeState state;
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    state.displacement.push_back((back.point(lattice.P[i]) - level.rest[i].cast<double>()).cast<float>());
    state.velocity.push_back(back.vector(lattice.P_dot[i]).cast<float>());
  }
  return state;
}

int reference_step(const Level& level, const StepInput& input, WorldLattice& lattice, double relative_residual) {
  const std::size_t n = level.rest.size();
  HAIRNET_ASSERT(lattice.P.size() == n);
  HAIRNET_ASSERT(lattice.P_dot.size() == n);
  HAIRNET_ASSERT(input.environment);
  HAIRNET_ASSERT(input.step_s > 0);
  HAIRNET_ASSERT(relative_residual > 0);
  const double h = input.step_s;
  // The rest R P^0 at the end of the step, and its velocity R' P^0.
  std::vector<Vec3> rest(n), rest_dot(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 p = level.rest[i].cast<double>();
    rest[i] = input.to.head().point(p);
    rest_dot[i] = (rest[i] - input.from.head().point(p)) / h;
  }

  System system{
      std::vector<Vec3>(n, Vec3::Zero()), std::vector<Mat3>(n, Mat3::Zero()), std::vector<Mat3>(n, Mat3::Zero()), {}};
  add_node_forces(level, input, rest, rest_dot, lattice, system);
  add_springs(level, input, lattice, system);
  add_attachments(level, input, rest, rest_dot, lattice, system);
  add_contacts(level, input, rest_dot, lattice, system);
  add_bodies(level, input, rest_dot, lattice, system);
  const Stiffeners held = held_points(level.contacts, input.touch ? input.touch->holds : std::span<const StepHold>());
  add_holds(level, input, held, rest, rest_dot, lattice, system);

  // (M - h df/dp' - h^2 df/dp) dP' = h (f + h df/dp P')
  const auto A = [&](const std::vector<Vec3>& x) {
    std::vector<Vec3> product = multiply(system, -h, -h * h, x);
    for (std::size_t i = 0; i < n; ++i) product[i] += double{node_mass(level, input.material, i)} * x[i];
    return product;
  };
  std::vector<Vec3> r = multiply(system, 0, h * h, lattice.P_dot);
  for (std::size_t i = 0; i < n; ++i) r[i] += h * system.f[i];

  // Plain conjugate gradient, without a preconditioner and from dP' = 0: the reference shares none of the choices of
  // the step that it judges.
  std::vector<Vec3> dP_dot(n, Vec3::Zero()), d = r;
  double rho = dot(r, r);
  const double enough = rho * relative_residual * relative_residual;
  // Exact arithmetic ends after 3 n iterations, one for each unknown. Rounding delays the end where stiffnesses differ
  // widely.
  const int iterations_max = 20 * static_cast<int>(n) + 100;
  int iteration = 0;
  for (; iteration < iterations_max && rho > enough; ++iteration) {
    const std::vector<Vec3> Ad = A(d);
    const double alpha = rho / dot(d, Ad);
    for (std::size_t i = 0; i < n; ++i) {
      dP_dot[i] += alpha * d[i];
      r[i] -= alpha * Ad[i];
    }
    const double rho_next = dot(r, r);
    for (std::size_t i = 0; i < n; ++i) d[i] = r[i] + rho_next / rho * d[i];
    rho = rho_next;
  }
  for (std::size_t i = 0; i < n; ++i) {
    // P moves with the velocity at the end of the step: backward Euler.
    lattice.P_dot[i] += dP_dot[i];
    lattice.P[i] += h * lattice.P_dot[i];
  }
  return iteration;
}

}  // namespace hairnet
