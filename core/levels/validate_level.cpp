#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/symmetric_matrix.hpp"
#include "core/levels/level.hpp"

namespace hairnet {
namespace {

// Levels come from files on a server's disk, which may be damaged or forged. The kernels check no index and no number,
// so everything that they rely on is checked here. This limit is far larger than any built value, and far below values
// at which the solver's sums overflow.
constexpr float kMax = 1e9f;
// The greatest size of a weight. Built weights are of size 1 at most before match_response() fits them, so this is far
// larger than any.
constexpr float kWeightMax = 1e3f;
// The rounding errors that are allowed in sums of weights and in rest values, which are exact by construction.
constexpr double kSumTolerance = 1e-4;
constexpr double kRestTolerance_m = 1e-4;

bool within(float value, float least, float most = kMax) {
  // The result is false for a NaN.
  return value >= least && value <= most;
}

bool all_within(const std::vector<float>& values, float least, float most = kMax) {
  for (const float value : values) {
    if (!within(value, least, most)) return false;
  }
  return true;
}

// Whether a drag matrix, xx xy xz yy yz zz, never pushes along the motion.
bool is_positive_semi_definite(const std::array<float, 6>& q) {
  for (const float c : q) {
    if (!within(c, -kMax)) return false;
  }
  Mat3 drag;
  drag << q[0], q[1], q[2], q[1], q[3], q[4], q[2], q[4], q[5];
  const Vec3 eigenvalues = symmetric_eigen(drag).values;
  // Drag that pushes forward would feed energy into every step.
  return eigenvalues[0] >= -1e-5 * std::abs(eigenvalues[2]);
}

std::string validate_nodes(const Level& level) {
  const std::size_t count = level.geometry.active_nodes.size();
  if (count == 0 || count > std::numeric_limits<std::uint16_t>::max()) return "nodes: none, or more than have an index";
  if (level.rest.size() != count || level.mass.size() != count || level.ether_stiffness.size() != count ||
      level.ether_damping.size() != count || level.drag.size() != count)
    return "nodes: counts disagree";
  for (std::size_t i = 0; i < count; ++i) {
    if (level.rest[i] != level.geometry.lattice.node(level.geometry.active_nodes[i]))
      return "nodes: one is not where the lattice has it";
    if (!is_positive_semi_definite(level.drag[i])) return "nodes: a drag that pushes forward, or is no number";
  }
  if (!all_within(level.mass, std::numeric_limits<float>::min())) return "nodes: a mass is not finite and positive";
  if (!all_within(level.ether_stiffness, 0) || !all_within(level.ether_damping, 0))
    return "nodes: ether is not finite and positive";
  return {};
}

std::string validate_counts(const Stiffeners& list) {
  const std::size_t count = list.stiffness.size();
  if (list.begin.size() != count + 1 || list.damping.size() != count || list.rest.size() != count ||
      list.weights.size() != list.nodes.size())
    return "counts disagree";
  if (list.begin.front() != 0 || list.begin.back() != list.nodes.size()) return "offsets are not those of the entries";
  for (std::size_t s = 0; s < count; ++s) {
    if (list.begin[s] >= list.begin[s + 1]) return "one without nodes, or offsets that descend";
  }
  return {};
}

// `weight_sum`: what the weights of each stiffener sum to, 0 for springs and 1 for attachments.
std::string validate_stiffeners(const Stiffeners& list, double weight_sum, const Level& level) {
  if (std::string error = validate_counts(list); !error.empty()) return error;
  if (!all_within(list.weights, -kWeightMax, kWeightMax)) return "a weight is not finite, or too large";
  if (!all_within(list.stiffness, std::numeric_limits<float>::min())) return "a stiffness is not finite and positive";
  if (!all_within(list.damping, 0)) return "a damping is not finite, or negative";
  for (std::size_t s = 0; s < list.count(); ++s) {
    double sum = 0, size = 0;
    Vec3 rest = Vec3::Zero();
    for (std::uint32_t e = list.begin[s]; e < list.begin[s + 1]; ++e) {
      if (list.nodes[e] >= level.rest.size()) return "a node does not exist";
      if (e > list.begin[s] && list.nodes[e - 1] >= list.nodes[e]) return "nodes do not ascend";
      const double weight = list.weights[e];
      sum += weight;
      size += std::abs(weight);
      rest += weight * level.rest[list.nodes[e]].cast<double>();
    }
    if (!(std::abs(sum - weight_sum) <= kSumTolerance * std::max(1.0, size))) return "weights have another sum";
    if (!((rest - list.rest[s].cast<double>()).norm() <= kRestTolerance_m * std::max(1.0, size)))
      return "a rest is not that of the nodes";
  }
  return {};
}

// Whether `begin` has the offsets of `runs` runs, from 0 on, and the end of the last one.
bool is_offsets(const std::vector<std::uint32_t>& begin, std::size_t runs, std::size_t end) {
  return begin.size() == runs + 1 && begin.front() == 0 && begin.back() == end && std::ranges::is_sorted(begin);
}

std::string validate_contacts(const Level& level) {
  const ContactPoints& contacts = level.contacts;
  const std::size_t count = contacts.count();
  if (!is_offsets(contacts.begin, count, contacts.nodes.size()) || contacts.weights.size() != contacts.nodes.size() ||
      contacts.potential.size() != count || contacts.limit.size() != count * level.skin->size())
    return "contacts: counts disagree";
  if (!all_within(contacts.weights, 0, 1)) return "contacts: a weight is not within 0 and 1";
  if (!all_within(contacts.potential, 0)) return "contacts: a potential is not finite, or negative";
  if (!all_within(contacts.limit, -kMax)) return "contacts: a limit is not finite";
  for (std::size_t p = 0; p < count; ++p) {
    if (!contacts.rest[p].allFinite() || contacts.rest[p].cwiseAbs().maxCoeff() > kMax)
      return "contacts: a point is not finite";
    float sum = 0;
    for (std::uint32_t e = contacts.begin[p]; e < contacts.begin[p + 1]; ++e) {
      if (contacts.nodes[e] >= level.rest.size()) return "contacts: a node does not exist";
      sum += contacts.weights[e];
    }
    if (!(sum <= 1 + static_cast<float>(kSumTolerance))) return "contacts: weights of more than 1";
  }
  return {};
}

}  // namespace

std::string validate(const Level& level) {
  if (std::string error = validate(level.geometry); !error.empty()) return error;
  if (std::ranges::min(level.geometry.lattice.dims) < 3)
    return "lattice: fewer than the 3 nodes an axis of quadratic FFD";
  if (!within(level.displacement_max_m, std::numeric_limits<float>::min())) return "no bound on displacements";
  if (std::string error = validate_nodes(level); !error.empty()) return error;
  if (std::string error = validate_stiffeners(level.springs, 0, level); !error.empty()) return "springs: " + error;
  if (std::string error = validate_stiffeners(level.attachments, 1, level); !error.empty())
    return "attachments: " + error;
  // put_incidences numbers both in 16 bits.
  if (level.springs.count() + level.attachments.count() > std::numeric_limits<std::uint16_t>::max())
    return "stiffeners: more than have an index";
  if (!level.skin) return "no skin";
  if (std::string error = validate(*level.skin); !error.empty()) return error;
  return validate_contacts(level);
}

}  // namespace hairnet
