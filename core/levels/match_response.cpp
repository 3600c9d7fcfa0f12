#include "core/levels/match_response.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <utility>

#include "core/assert.hpp"
#include "core/levels/node_matrix.hpp"

namespace hairnet {
namespace {

// The time scale tau of match_response.hpp: that of the motions for which the responses must agree.
constexpr double kResponse_s = 0.2;
// The loads: an affine acceleration has a constant and three slopes on each of three axes, which makes 12; and there
// are 12 waves.
constexpr int kAffineCount = 12, kWaveCount = 12;
// The length of the waves, relative to the lattice's greatest extent.
constexpr double kWaveLength = 0.5;
constexpr int kIterations = 20;
// Weighs the mean square relative change of the weights against the error. Without this term, weights that no load
// determines would drift far from the merged springs.
constexpr double kStayWeight = 1e-3;
// A spring's vector may grow or shrink by at most this factor when its weights change, since a spring that shrinks to
// nothing has no direction.
constexpr double kLengthChangeMax = 3;

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The first of a node's three rows in loads and displacements.
Index row(std::size_t node) {
  return static_cast<Index>(3 * node);
}

std::span<const std::uint16_t> nodes_of(const Stiffeners& list, std::size_t s) {
  HAIRNET_VALIDATE(s < list.count());
  return {list.nodes.data() + list.begin[s], list.nodes.data() + list.begin[s + 1]};
}

// The stiffener's k + q / tau, its stiffness in A.
double with_damping(const Stiffeners& list, std::size_t s) {
  return double{list.stiffness[s]} + double{list.damping[s]} / kResponse_s;
}

// The loads: mass times an acceleration, one column each.
MatrixXd smooth_loads(const Level& level) {
  HAIRNET_ASSERT(!level.rest.empty());
  HAIRNET_ASSERT(level.mass.size() == level.rest.size());
  Vec3f low = level.rest.front(), high = low;
  for (const Vec3f& p : level.rest) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double extent = static_cast<double>((high - low).maxCoeff());
  HAIRNET_ASSERT(extent > 0);
  MatrixXd loads = MatrixXd::Zero(row(level.rest.size()), kAffineCount + kWaveCount);
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const Vec3 p = level.rest[i].cast<double>();
    for (int axis = 0; axis < 3; ++axis) {
      for (int term = 0; term < 4; ++term) loads(row(i) + axis, 4 * axis + term) = term == 0 ? 1 : p[term - 1];
    }
    for (int wave = 0; wave < kWaveCount; ++wave) {
      // Directions are spread evenly over the half sphere, phases by the same golden angle.
      const double z = (wave + 0.5) / kWaveCount, turn = wave * std::numbers::pi * (3 - std::sqrt(5.0));
      const Vec3 direction(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
      const double wave_number = 2 * std::numbers::pi / (kWaveLength * extent);
      loads(row(i) + wave % 3, kAffineCount + wave) = std::sin(wave_number * direction.dot(p) + turn);
    }
    loads.middleRows<3>(row(i)) *= double{level.mass[i]};
  }
  return loads;
}

// The mass of the hair alone, one entry for each row. The ether's share is the same at all nodes, and makes up nearly
// all of the smallest mass; 80 % of that mass are taken for it.
VectorXd hair_mass(const Level& level) {
  HAIRNET_ASSERT(level.mass.size() == level.rest.size());
  const double ether = 0.8 * double{*std::ranges::min_element(level.mass)};
  HAIRNET_ASSERT(ether > 0);
  VectorXd mass(row(level.rest.size()));
  for (std::size_t i = 0; i < level.rest.size(); ++i)
    mass.segment<3>(row(i)).setConstant(double{level.mass[i]} - ether);
  return mass;
}

// Adds all parts of A except the springs: mass, ether, drag and attachments.
void add_others(const Level& level, const Stiffeners& attachments, NodeMatrix& matrix) {
  HAIRNET_ASSERT(level.ether_stiffness.size() == level.rest.size());
  HAIRNET_ASSERT(level.ether_damping.size() == level.rest.size());
  HAIRNET_ASSERT(level.drag.size() == level.rest.size());
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const double diagonal = double{level.mass[i]} / (kResponse_s * kResponse_s) +
                            double{level.ether_damping[i]} / kResponse_s + double{level.ether_stiffness[i]};
    matrix.add(i, isotropic_and_axial(diagonal, 0, Vec3::Zero()));
    SymmetricBlock drag{};
    std::ranges::copy(level.drag[i], drag.begin());
    matrix.add(i, scaled(1 / kResponse_s, drag));
  }
  for (std::size_t s = 0; s < attachments.count(); ++s) {
    const std::vector<double> weights(attachments.weights.begin() + attachments.begin[s],
                                      attachments.weights.begin() + attachments.begin[s + 1]);
    matrix.add(nodes_of(attachments, s), weights, isotropic_and_axial(with_damping(attachments, s), 0, Vec3::Zero()));
  }
}

// Loads, scaled so that each moves the full model by the same amount, and the full model's displacements under each.
struct Responses {
  MatrixXd loads, displacements;
};

// The response of the full model: all springs and attachments before decimation. Without displacements when A cannot be
// factored.
Responses respond(const Stiffeners& springs, const Stiffeners& attachments, const Level& level, const VectorXd& mass) {
  HAIRNET_ASSERT(springs.rest.size() == springs.count());
  HAIRNET_ASSERT(mass.size() == row(level.rest.size()));
  NodeMatrix matrix(level.rest.size(), {&springs, &attachments});
  matrix.set_zero();
  add_others(level, attachments, matrix);
  for (std::size_t s = 0; s < springs.count(); ++s) {
    const std::vector<double> weights(springs.weights.begin() + springs.begin[s],
                                      springs.weights.begin() + springs.begin[s + 1]);
    const Vec3 e = springs.rest[s].cast<double>().normalized();
    matrix.add(nodes_of(springs, s), weights, isotropic_and_axial(0, with_damping(springs, s), e));
  }
  Responses responses{smooth_loads(level), {}};
  if (!matrix.factor()) return responses;
  responses.displacements = matrix.solve(responses.loads);
  for (Index f = 0; f < responses.loads.cols(); ++f) {
    const double size = std::sqrt(mass.dot(responses.displacements.col(f).cwiseAbs2()));
    if (!(size > 0)) continue;
    responses.loads.col(f) /= size;
    responses.displacements.col(f) /= size;
  }
  return responses;
}

// The error as a function of all springs' weights. Spring s is z_s z_s^T with z_s = sqrt(k_s) w_s = size_s x_s, so that
// x, the unknown, starts with unit length for each spring.
class ResponseError {
 private:
  template <class Vector>
  // Returns the part of spring s.
  auto of(Vector& x, std::size_t s) const {
    return x.segment(static_cast<Index>(springs_.begin[s]),
                     static_cast<Index>(springs_.begin[s + 1] - springs_.begin[s]));
  }

 public:
  ResponseError(const Responses& wanted, const VectorXd& mass, const Level& level)
      : wanted_(wanted),
        mass_(mass),
        level_(level),
        springs_(level.springs),
        matrix_(level.rest.size(), {&level.springs, &level.attachments}),
        start_(static_cast<Index>(level.springs.weights.size())) {
    HAIRNET_ASSERT(springs_.count() > 0);
    HAIRNET_ASSERT(springs_.weights.size() == springs_.nodes.size());
    HAIRNET_ASSERT(springs_.damping.size() == springs_.count());
    HAIRNET_ASSERT(mass.size() == row(level.rest.size()));
    HAIRNET_ASSERT(wanted.displacements.rows() == mass.size());
    HAIRNET_ASSERT(wanted.displacements.cols() == wanted.loads.cols());
    for (std::size_t s = 0; s < springs_.count(); ++s) {
      auto x = of(start_, s);
      for (Index e = 0; e < x.size(); ++e)
        x[e] = double{springs_.weights[springs_.begin[s] + static_cast<std::size_t>(e)]};
      size_.push_back(std::sqrt(with_damping(springs_, s)) * x.norm());
      x.normalize();
      start_length_.push_back(vector(start_, s).norm());
    }
  }

  [[nodiscard]] const VectorXd& start() const { return start_; }

  // The error at x and, unless it is null, its gradient. Infinite where a spring's vector changes its length too much,
  // or where the system cannot be solved.
  double value(const VectorXd& x, VectorXd* gradient) {
    HAIRNET_ASSERT(x.size() == start_.size());
    for (std::size_t s = 0; s < springs_.count(); ++s) {
      const double ratio = vector(x, s).norm() / start_length_[s];
      if (!(ratio < kLengthChangeMax && ratio > 1 / kLengthChangeMax)) return std::numeric_limits<double>::infinity();
    }
    assemble(x);
    if (!matrix_.factor()) return std::numeric_limits<double>::infinity();
    const MatrixXd u = matrix_.solve(wanted_.loads);
    const MatrixXd weighted = mass_.asDiagonal() * (u - wanted_.displacements);
    const double load_count = static_cast<double>(u.cols());
    const double stay = kStayWeight / static_cast<double>(springs_.count());
    if (gradient) {
      // One more solution gives the derivative by all weights (adjoint method); differences would take one for each
      // weight.
      const MatrixXd adjoint = matrix_.solve(weighted);
      gradient->resize(x.size());
      for (std::size_t s = 0; s < springs_.count(); ++s)
        of(*gradient, s) = spring_gradient(x, s, u, adjoint) / load_count;
      *gradient += 2 * stay * (x - start_);
    }
    return weighted.cwiseProduct(u - wanted_.displacements).sum() / load_count + stay * (x - start_).squaredNorm();
  }

  // Stores the springs of x in the level: each spring keeps its length, and k gets the value for which k w w^T is z
  // z^T.
  void store(const VectorXd& x, Level& level) const {
    HAIRNET_ASSERT(&level == &level_);
    HAIRNET_ASSERT(x.size() == start_.size());
    Stiffeners& springs = level.springs;
    for (std::size_t s = 0; s < springs.count(); ++s) {
      const double damping_time_s = double{springs.damping[s]} / double{springs.stiffness[s]};
      const double length = springs.rest[s].cast<double>().norm(), length_x = vector(x, s).norm();
      // size^2 stands for k + q / tau. With q = k times the damping time, k is this divided by 1 + damping time / tau.
      const double stiffness = std::pow(size_[s] * length_x / length, 2) / (1 + damping_time_s / kResponse_s);
      springs.stiffness[s] = static_cast<float>(stiffness);
      springs.damping[s] = static_cast<float>(stiffness * damping_time_s);
      Vec3 rest = Vec3::Zero();
      for (std::uint32_t e = springs.begin[s]; e < springs.begin[s + 1]; ++e) {
        springs.weights[e] = static_cast<float>(x[static_cast<Index>(e)] * length / length_x);
        rest += double{springs.weights[e]} * level.rest[springs.nodes[e]].cast<double>();
      }
      springs.rest[s] = rest.cast<float>();
    }
  }

 private:
  // The vector sum x_j p_j^0 along spring s.
  [[nodiscard]] Vec3 vector(const VectorXd& x, std::size_t s) const {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t e = springs_.begin[s]; e < springs_.begin[s + 1]; ++e) {
      sum += x[static_cast<Index>(e)] * level_.rest[springs_.nodes[e]].cast<double>();
    }
    return sum;
  }

  void assemble(const VectorXd& x) {
    matrix_.set_zero();
    add_others(level_, level_.attachments, matrix_);
    for (std::size_t s = 0; s < springs_.count(); ++s) {
      const auto weights = of(x, s);
      matrix_.add(nodes_of(springs_, s), {weights.data(), static_cast<std::size_t>(weights.size())},
                  isotropic_and_axial(0, size_[s] * size_[s], vector(x, s).normalized()));
    }
  }

  // The derivative by x_s of the sum over loads of m |u - wanted|^2, along the x_s that sum to 0. With l = A^-1 m (u -
  // wanted) it is -2 d (e.a)(e.c), where a = sum z_j l_j and c = sum z_j u_j, and e turns with x.
  [[nodiscard]] VectorXd spring_gradient(const VectorXd& x, std::size_t s, const MatrixXd& u,
                                         const MatrixXd& adjoint) const {
    const auto nodes = nodes_of(springs_, s);
    const auto weights = of(x, s);
    Eigen::Matrix3Xd a = Eigen::Matrix3Xd::Zero(3, u.cols()), c = a;
    for (std::size_t j = 0; j < nodes.size(); ++j) {
      a += weights[static_cast<Index>(j)] * adjoint.middleRows<3>(row(nodes[j]));
      c += weights[static_cast<Index>(j)] * u.middleRows<3>(row(nodes[j]));
    }
    const Vec3 along = vector(x, s), e = along.normalized();
    const Eigen::RowVectorXd e_a = e.transpose() * a, e_c = e.transpose() * c;
    Vec3 turning = a * e_c.transpose() + c * e_a.transpose();
    turning = (turning - e * e.dot(turning)) / along.norm();
    VectorXd gradient(weights.size());
    for (std::size_t j = 0; j < nodes.size(); ++j) {
      gradient[static_cast<Index>(j)] = (e.transpose() * adjoint.middleRows<3>(row(nodes[j]))).dot(e_c) +
                                        (e.transpose() * u.middleRows<3>(row(nodes[j]))).dot(e_a) +
                                        turning.dot(level_.rest[nodes[j]].cast<double>());
    }
    // The weights of a spring sum to 0, and the gradient is projected so that they still do after a step.
    gradient.array() -= gradient.mean();
    return -2 * size_[s] * size_[s] * gradient;
  }

  const Responses& wanted_;
  const VectorXd& mass_;
  const Level& level_;
  const Stiffeners& springs_;
  NodeMatrix matrix_;
  VectorXd start_;
  std::vector<double> size_, start_length_;
};

// The memory of L-BFGS: the last ten steps and changes of the gradient, which approximate the second derivative
// (Nocedal 1980).
class CurvatureMemory {
 public:
  void put(VectorXd step, VectorXd change) {
    HAIRNET_ASSERT(step.size() == change.size());
    HAIRNET_ASSERT(pairs_.empty() || step.size() == pairs_.front().first.size());
    // A pair of negative curvature would make a direction that does not descend.
    if (!(step.dot(change) > 0)) return;
    pairs_.emplace_back(std::move(step), std::move(change));
    if (pairs_.size() > 10) pairs_.pop_front();
  }

  // The direction of the next step, by the two-loop recursion.
  [[nodiscard]] VectorXd descent(const VectorXd& gradient) const {
    HAIRNET_ASSERT(gradient.norm() > 0);
    HAIRNET_ASSERT(pairs_.empty() || gradient.size() == pairs_.front().first.size());
    if (pairs_.empty()) return -kFirstStep / gradient.norm() * gradient;
    VectorXd direction = -gradient;
    std::vector<double> alphas(pairs_.size());
    for (std::size_t i = pairs_.size(); i-- > 0;) {
      const auto& [step, change] = pairs_[i];
      alphas[i] = step.dot(direction) / step.dot(change);
      direction -= alphas[i] * change;
    }
    direction *= pairs_.back().first.dot(pairs_.back().second) / pairs_.back().second.squaredNorm();
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const auto& [step, change] = pairs_[i];
      direction += (alphas[i] - change.dot(direction) / step.dot(change)) * step;
    }
    return direction;
  }

 private:
  // The length of the first step, before any curvature is known. Each spring's x has unit length.
  static constexpr double kFirstStep = 0.1;
  std::deque<std::pair<VectorXd, VectorXd>> pairs_;
};

// One step of descent, halved until the error falls enough. Returns false when the error does not fall.
bool descend(ResponseError& error, const CurvatureMemory& memory, VectorXd& x, VectorXd& gradient, double& value) {
  HAIRNET_ASSERT(gradient.size() == x.size());
  HAIRNET_ASSERT(std::isfinite(value));
  const VectorXd direction = memory.descent(gradient);
  const double slope = gradient.dot(direction);
  VectorXd next_gradient;
  double share = 1;
  for (int attempt = 0; attempt < 10; ++attempt, share *= 0.5) {
    const VectorXd next = x + share * direction;
    const double next_value = error.value(next, &next_gradient);
    // Armijo's rule with the customary 1e-4. An infinite value, or NaN, fails as well, so steps to springs that are not
    // permitted are halved.
    if (!(next_value < value + 1e-4 * share * slope)) continue;
    x = next;
    gradient = next_gradient;
    value = next_value;
    return true;
  }
  return false;
}

}  // namespace

bool match_response(const Stiffeners& all_springs, const Stiffeners& all_attachments, Level& level,
                    const std::function<bool(double)>& keep_going) {
  if (level.springs.count() == 0) return true;
  const VectorXd mass = hair_mass(level);
  const Responses wanted = respond(all_springs, all_attachments, level, mass);
  if (wanted.displacements.size() == 0) return true;
  ResponseError error(wanted, mass, level);
  VectorXd x = error.start(), gradient;
  double value = error.value(x, &gradient);
  // The merged springs are a valid level by themselves, so a fit that cannot begin leaves them.
  if (!std::isfinite(value)) return true;
  CurvatureMemory memory;
  for (int i = 0; i < kIterations; ++i) {
    if (keep_going && !keep_going(static_cast<double>(i) / kIterations)) return false;
    // L-BFGS. When the error does not fall any more, the last springs are the result.
    const VectorXd before = x, gradient_before = gradient;
    if (!(gradient.norm() > 0) || !descend(error, memory, x, gradient, value)) break;
    memory.put(x - before, gradient - gradient_before);
  }
  error.store(x, level);
  return true;
}

double response_error(const Stiffeners& all_springs, const Stiffeners& all_attachments, const Level& level) {
  HAIRNET_ASSERT(level.springs.count() > 0);
  const VectorXd mass = hair_mass(level);
  const Responses wanted = respond(all_springs, all_attachments, level, mass);
  ResponseError error(wanted, mass, level);
  return std::sqrt(error.value(error.start(), nullptr));
}

}  // namespace hairnet
