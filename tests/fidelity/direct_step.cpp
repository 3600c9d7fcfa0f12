#include "tests/fidelity/direct_step.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/solver/head_motion.hpp"
#include "core/solver/metaball.hpp"
#include "core/solver/spring.hpp"

namespace hairnet::fidelity {
namespace {

// The viscosity that acts in a step of h, from that asked for.
double effective_damping(double q, [[maybe_unused]] double k, [[maybe_unused]] double h) {
  return q;
}

// a I + b e e^T
std::array<double, 6> isotropic_and_axial(double a, double b, const Vec3& e) {
  return {a + b * e[0] * e[0], b * e[0] * e[1],     b * e[0] * e[2],
          a + b * e[1] * e[1], b * e[1] * e[2],     a + b * e[2] * e[2]};
}

void add_scaled(const std::array<double, 6>& from, double scale, std::array<double, 6>& to) {
  for (std::size_t c = 0; c < 6; ++c) to[c] += scale * from[c];
}

Mat3 full(const std::array<double, 6>& b) {
  return Mat3{{b[0], b[1], b[2]}, {b[1], b[3], b[4]}, {b[2], b[4], b[5]}};
}

Vec3 weighted_sum(const Stiffeners& s, std::size_t index, const std::vector<Vec3>& nodes) {
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t e = s.begin[index]; e < s.begin[index + 1]; ++e) sum += double{s.weights[e]} * nodes[s.nodes[e]];
  return sum;
}

void scatter(const Stiffeners& s, std::size_t index, const Vec3& sigma, std::vector<Vec3>& nodes) {
  for (std::uint32_t e = s.begin[index]; e < s.begin[index + 1]; ++e) nodes[s.nodes[e]] += double{s.weights[e]} * sigma;
}

// Calls visit(row, column) for each pair of a stiffener's nodes, row >= column.
template <class Visit>
void for_each_pair(const Stiffeners& s, std::size_t index, const Visit& visit) {
  for (std::uint32_t j = s.begin[index]; j < s.begin[index + 1]; ++j) {
    for (std::uint32_t i = j; i < s.begin[index + 1]; ++i) visit(i, j);
  }
}

}  // namespace

DirectStep::DirectStep(const Level& level) : level_(level), load_(level.rest.size()) {
  find_pattern();
}

void DirectStep::find_pattern() {
  const std::size_t n = level_.rest.size();
  std::vector<std::set<std::uint32_t>> columns(n);
  for (std::uint32_t i = 0; i < n; ++i) columns[i].insert(i);
  for (const Stiffeners* list : {&level_.springs, &level_.attachments}) {
    for (std::size_t s = 0; s < list->count(); ++s) {
      for_each_pair(*list, s, [&](auto i, auto j) { columns[list->nodes[j]].insert(list->nodes[i]); });
    }
  }
  column_begin_.assign(1, 0);
  for (const auto& column : columns) {
    rows_.insert(rows_.end(), column.begin(), column.end());
    column_begin_.push_back(static_cast<std::uint32_t>(rows_.size()));
  }
  blocks_.resize(rows_.size());
  const auto find_slots = [&](const Stiffeners& list, std::vector<std::uint32_t>& slots) {
    for (std::size_t s = 0; s < list.count(); ++s) {
      for_each_pair(list, s, [&](auto i, auto j) {
        const auto first = rows_.begin() + column_begin_[list.nodes[j]];
        const auto last = rows_.begin() + column_begin_[list.nodes[j] + 1u];
        slots.push_back(static_cast<std::uint32_t>(std::lower_bound(first, last, list.nodes[i]) - rows_.begin()));
      });
    }
  };
  find_slots(level_.springs, spring_slots_);
  find_slots(level_.attachments, attachment_slots_);

  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t j = 0; j < n; ++j) {
    for (std::uint32_t b = column_begin_[j]; b < column_begin_[j + 1]; ++b) {
      for (int c = 0; c < 3; ++c) {
        for (int r = rows_[b] == j ? c : 0; r < 3; ++r) {
          entries.emplace_back(static_cast<int>(3 * rows_[b]) + r, static_cast<int>(3 * j) + c, 0.0);
        }
      }
    }
  }
  const auto size = static_cast<Eigen::Index>(3 * n);
  matrix_.resize(size, size);
  matrix_.setFromTriplets(entries.begin(), entries.end());
  factors_.analyzePattern(matrix_);
}

void DirectStep::add_pairs(const Stiffeners& stiffeners, std::size_t s, const std::vector<std::uint32_t>& slots,
                           std::size_t slot_begin, const Block& block) {
  std::size_t slot = slot_begin;
  for_each_pair(stiffeners, s, [&](auto i, auto j) {
    add_scaled(block, double{stiffeners.weights[i]} * double{stiffeners.weights[j]}, blocks_[slots[slot++]]);
  });
}

void DirectStep::add_nodes(const StepInput& input, const WorldLattice& lattice) {
  const double h = input.step_s;
  const Mat3 R = input.to.head().rotation.toRotationMatrix();
  for (std::size_t i = 0; i < level_.rest.size(); ++i) {
    const Vec3 at_rest = level_.rest[i].cast<double>();
    const Vec3 rest = input.to.head().point(at_rest), rest_dot = (rest - input.from.head().point(at_rest)) / h;
    const double m = level_.mass[i], k = level_.ether_stiffness[i];
    const double q = effective_damping(level_.ether_damping[i], k, h);
    Block drag{};
    std::copy(level_.drag[i].begin(), level_.drag[i].end(), drag.begin());
    const Mat3 Q = R * full(drag) * R.transpose();
    const Vec3 f = -k * (lattice.P[i] - rest) - q * (lattice.P_dot[i] - rest_dot) +
                   m * (input.environment.gravity - R * kDesignGravity) -
                   Q * (lattice.P_dot[i] - input.environment.wind);
    load_[i] += h * (f - h * k * lattice.P_dot[i]);
    Block& diagonal = blocks_[column_begin_[i]];
    add_scaled({1, 0, 0, 1, 0, 1}, m + h * q + h * h * k, diagonal);
    add_scaled({Q(0, 0), Q(0, 1), Q(0, 2), Q(1, 1), Q(1, 2), Q(2, 2)}, h, diagonal);
  }
}

void DirectStep::add_springs(double h, const WorldLattice& lattice) {
  const Stiffeners& springs = level_.springs;
  std::size_t slot = 0;
  for (std::size_t s = 0; s < springs.count(); ++s) {
    const std::size_t pair_begin = slot, entry_count = springs.begin[s + 1] - springs.begin[s];
    slot += entry_count * (entry_count + 1) / 2;
    const double k = springs.stiffness[s], q = effective_damping(springs.damping[s], k, h);
    const Vec3 eps = weighted_sum(springs, s, lattice.P), eps_dot = weighted_sum(springs, s, lattice.P_dot);
    if (!(eps.norm() > 0)) continue;
    const Vec3 e = eps.normalized();
    const Vec3 sigma = spring_force(k, q, springs.rest[s].cast<double>().norm(), eps, eps_dot);
    scatter(springs, s, h * (sigma - h * k * e.dot(eps_dot) * e), load_);
    add_pairs(springs, s, spring_slots_, pair_begin, isotropic_and_axial(0, h * q + h * h * k, e));
  }
}

void DirectStep::add_attachments(const StepInput& input, const WorldLattice& lattice) {
  const double h = input.step_s;
  const Stiffeners& attachments = level_.attachments;
  std::vector<Vec3> rest, rest_dot;
  for (const Vec3f& at_rest : level_.rest) {
    rest.push_back(input.to.head().point(at_rest.cast<double>()));
    rest_dot.push_back((rest.back() - input.from.head().point(at_rest.cast<double>())) / h);
  }
  std::size_t slot = 0;
  for (std::size_t s = 0; s < attachments.count(); ++s) {
    const double k = attachments.stiffness[s], q = effective_damping(attachments.damping[s], k, h);
    const Vec3 eps = weighted_sum(attachments, s, lattice.P), eps_dot = weighted_sum(attachments, s, lattice.P_dot);
    const Vec3 eps_0 = weighted_sum(attachments, s, rest), eps_0_dot = weighted_sum(attachments, s, rest_dot);
    const Vec3 sigma = -k * (eps - eps_0) - q * (eps_dot - eps_0_dot);
    scatter(attachments, s, h * (sigma - h * k * eps_dot), load_);
    const std::size_t entry_count = attachments.begin[s + 1] - attachments.begin[s];
    add_pairs(attachments, s, attachment_slots_, slot, isotropic_and_axial(h * q + h * h * k, 0, Vec3::Zero()));
    slot += entry_count * (entry_count + 1) / 2;
  }
}

void DirectStep::add_contacts(const StepInput& input, const WorldLattice& lattice) {
  const double h = input.step_s;
  for (const Metaball& ball : level_.metaballs) {
    const RigidTransform carry = input.to[ball.bone] * input.from[ball.bone].inverse();
    const Vec3 centre = input.to[ball.bone].point(ball.centre.cast<double>());
    for (std::size_t i = 0; i < level_.rest.size(); ++i) {
      const double rho = ball.radius[i];
      const Vec3 with_bone = carry.point(lattice.P[i]);
      const Vec3 r = with_bone - centre;
      if (!(rho > 0) || !(r.norm() < rho) || !(r.norm() > 0)) continue;
      const Vec3 out = r.normalized();
      const Vec3 to_home = input.to.head().point(level_.rest[i].cast<double>()) - with_bone;
      const double U = ball.potential[i] * (1 - released_share(input.contact_release, out, to_home));
      const double k = metaball_radial_stiffness(U, rho, r);
      const Vec3 along = lattice.P[i] - with_bone + h * lattice.P_dot[i];
      load_[i] += h * (metaball_force(U, rho, r) - k * out.dot(along) * out);
      add_scaled(isotropic_and_axial(0, k, out), h * h, blocks_[column_begin_[i]]);
    }
  }
}

void DirectStep::fill_matrix() {
  double* value = matrix_.valuePtr();
  for (std::size_t j = 0; j < level_.rest.size(); ++j) {
    for (int c = 0; c < 3; ++c) {
      for (std::uint32_t b = column_begin_[j]; b < column_begin_[j + 1]; ++b) {
        const Mat3 block = full(blocks_[b]);
        for (int r = rows_[b] == j ? c : 0; r < 3; ++r) *value++ = block(r, c);
      }
    }
  }
}

bool DirectStep::step(const StepInput& input, WorldLattice& lattice) {
  std::ranges::fill(blocks_, Block{});
  std::ranges::fill(load_, Vec3::Zero());
  add_nodes(input, lattice);
  add_springs(input.step_s, lattice);
  add_attachments(input, lattice);
  add_contacts(input, lattice);
  fill_matrix();
  factors_.factorize(matrix_);
  if (factors_.info() != Eigen::Success) return false;
  const auto size = static_cast<Eigen::Index>(3 * load_.size());
  const Eigen::VectorXd dP_dot = factors_.solve(Eigen::Map<const Eigen::VectorXd>(load_.front().data(), size));
  if (!dP_dot.allFinite()) return false;
  for (std::size_t i = 0; i < load_.size(); ++i) {
    lattice.P_dot[i] += dP_dot.segment<3>(static_cast<Eigen::Index>(3 * i));
    lattice.P[i] += input.step_s * lattice.P_dot[i];
  }
  return true;
}

}  // namespace hairnet::fidelity
