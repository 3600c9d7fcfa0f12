#include "tests/fidelity/direct_step.hpp"

#include <algorithm>
#include <span>

#include "core/solver/contact_list.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/node_terms.hpp"
#include "core/solver/spring.hpp"
#include "core/solver/weighted_sum.hpp"

namespace hairnet::fidelity {
namespace {

std::span<const std::uint16_t> nodes_of(const Stiffeners& s, std::size_t index) {
  return {s.nodes.data() + s.begin[index], s.nodes.data() + s.begin[index + 1]};
}

std::span<const double> weights_of(const Stiffeners& s, std::size_t index, const std::vector<double>& weights) {
  return {weights.data() + s.begin[index], weights.data() + s.begin[index + 1]};
}

}  // namespace

DirectStep::DirectStep(const Level& level)
    : level_(level),
      spring_weights_(level.springs.weights.begin(), level.springs.weights.end()),
      attachment_weights_(level.attachments.weights.begin(), level.attachments.weights.end()),
      matrix_(level.rest.size(), {&level.springs, &level.attachments}),
      load_(level.rest.size()) {}

// The terms of each node: mass, ether, gravity and drag. Gravity counts as a difference from that of the design, in
// whose shape it has acted already. `u` is the velocity of the air.
void DirectStep::add_nodes(const StepInput& input, const WorldLattice& lattice) {
  const double h = input.step_s;
  const Mat3 R = input.to.head().rotation.toRotationMatrix();
  const NodeWind wind(level_.geometry.lattice, input);
  for (std::size_t i = 0; i < level_.rest.size(); ++i) {
    const Vec3 at_rest = level_.rest[i].cast<double>();
    const Vec3 rest = input.to.head().point(at_rest), rest_dot = (rest - input.from.head().point(at_rest)) / h;
    const double m = node_mass(level_, input.material, i), k = ether_stiffness(level_, input.material, i),
                 q = ether_damping(level_, input.material, i, static_cast<float>(h));
    const Mat3 Q = R * drag_tensor(level_, input.material, i).cast<double>() * R.transpose();
    const Vec3 u = R * wind.at(level_.geometry.active_nodes[i]).cast<double>();
    const Vec3 f = -k * (lattice.P[i] - rest) - q * (lattice.P_dot[i] - rest_dot) +
                   m * (input.environment->gravity - R * kDesignGravity) - Q * (lattice.P_dot[i] - u);
    load_[i] += h * (f - h * k * lattice.P_dot[i]);
    matrix_.add(i, isotropic_and_axial(m + h * q + h * h * k, 0, Vec3::Zero()));
    matrix_.add(i, scaled(h, {Q(0, 0), Q(0, 1), Q(0, 2), Q(1, 1), Q(1, 2), Q(2, 2)}));
  }
}

// Springs (eq. 3). `eps` is the weighted sum of the nodes, the vector between the spring's ends, and `e` its direction.
void DirectStep::add_springs(const StepInput& input, const WorldLattice& lattice) {
  const double h = input.step_s;
  const Stiffeners& springs = level_.springs;
  for (std::size_t s = 0; s < springs.count(); ++s) {
    const Vec3 eps = weighted_sum(springs, s, lattice.P), eps_dot = weighted_sum(springs, s, lattice.P_dot);
    if (!(eps.norm() > 0)) continue;
    const Vec3 e = eps.normalized();
    const SpringTerms spring = spring_terms(level_, input, s, eps.norm());
    const Vec3 sigma = spring_force(spring.k, spring.q, spring.rest_length, eps, eps_dot);
    scatter(springs, s, h * (sigma - h * spring.stiffness * e.dot(eps_dot) * e), load_);
    matrix_.add(nodes_of(springs, s), weights_of(springs, s, spring_weights_),
                isotropic_and_axial(0, h * spring.q + h * h * spring.stiffness, e));
  }
}

// Attachments (eq. 4) pull the weighted sum of nodes to where it is in the rigid shape, which moves with the head.
void DirectStep::add_attachments(const StepInput& input, const WorldLattice& lattice) {
  const double h = input.step_s;
  const Stiffeners& attachments = level_.attachments;
  std::vector<Vec3> rest, rest_dot;
  for (const Vec3f& at_rest : level_.rest) {
    rest.push_back(input.to.head().point(at_rest.cast<double>()));
    rest_dot.push_back((rest.back() - input.from.head().point(at_rest.cast<double>())) / h);
  }
  for (std::size_t s = 0; s < attachments.count(); ++s) {
    const auto [hold_k, hold_q] = stiffener_terms(attachments, input.material, s, static_cast<float>(h));
    const double k = hold_k, q = hold_q;
    const Vec3 eps = weighted_sum(attachments, s, lattice.P), eps_dot = weighted_sum(attachments, s, lattice.P_dot);
    const Vec3 eps_0 = weighted_sum(attachments, s, rest), eps_0_dot = weighted_sum(attachments, s, rest_dot);
    const Vec3 sigma = -k * (eps - eps_0) - q * (eps_dot - eps_0_dot);
    scatter(attachments, s, h * (sigma - h * k * eps_dot), load_);
    matrix_.add(nodes_of(attachments, s), weights_of(attachments, s, attachment_weights_),
                isotropic_and_axial(h * q + h * h * k, 0, Vec3::Zero()));
  }
}

// Contacts push along the skin's normal only. Each node takes the share of its weight.
void DirectStep::add_contacts(const StepInput& input, const WorldLattice& lattice) {
  const double h = input.step_s;
  const ContactPoints& points = level_.contacts;
  for (const Contact& contact : find_contacts(level_, input, lattice)) {
    for (std::uint32_t e = points.begin[contact.point]; e < points.begin[contact.point + 1]; ++e) {
      const std::size_t i = points.nodes[e];
      const Vec3 rest = level_.rest[i].cast<double>();
      const Vec3 rest_dot = (input.to.head().point(rest) - input.from.head().point(rest)) / h;
      const double weight = points.weights[e], along = h * contact.normal.dot(lattice.P_dot[i] - rest_dot);
      load_[i] += h * weight * (contact.force - contact.stiffness * along) * contact.normal;
      matrix_.add(i, isotropic_and_axial(0, h * h * weight * contact.stiffness, contact.normal));
    }
  }
}

// Solves (M - h df/dP' - h^2 df/dP) dP' = h (f + h df/dP P') for the change of velocity dP', and then moves the nodes
// by h P'.
bool DirectStep::step(const StepInput& input, WorldLattice& lattice) {
  matrix_.set_zero();
  std::ranges::fill(load_, Vec3::Zero());
  add_nodes(input, lattice);
  add_springs(input, lattice);
  add_attachments(input, lattice);
  add_contacts(input, lattice);
  if (!matrix_.factor()) return false;
  const auto size = static_cast<Eigen::Index>(3 * load_.size());
  const Eigen::VectorXd dP_dot = matrix_.solve(Eigen::Map<const Eigen::VectorXd>(load_.front().data(), size));
  if (!dP_dot.allFinite()) return false;
  for (std::size_t i = 0; i < load_.size(); ++i) {
    lattice.P_dot[i] += dP_dot.segment<3>(static_cast<Eigen::Index>(3 * i));
    lattice.P[i] += input.step_s * lattice.P_dot[i];
  }
  return true;
}

}  // namespace hairnet::fidelity
