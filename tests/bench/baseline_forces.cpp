#include "tests/bench/baseline_forces.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet::bench {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Plain structs as Eigen's types, without a copy.
Eigen::Map<const Matrix3d> rotation(const PlainTransform& t) {
  return Eigen::Map<const Matrix3d>(t.rotation);
}
Eigen::Map<const Vector3d> vector_at(const double* numbers, std::size_t index = 0) {
  return Eigen::Map<const Vector3d>(numbers + 3 * index);
}
Vector3d point(const PlainTransform& t, const Vector3d& x) {
  return rotation(t) * x + vector_at(t.position);
}

Vector3d weighted_sum(const PlainStiffeners& s, std::size_t index, const Eigen::Ref<const Eigen::Matrix3Xd>& nodes) {
  Vector3d sum = Vector3d::Zero();
  for (std::uint32_t e = s.begin[index]; e < s.begin[index + 1]; ++e) sum += s.weights[e] * nodes.col(s.nodes[e]);
  return sum;
}

void scatter(const PlainStiffeners& s, std::size_t index, const Vector3d& sigma, Eigen::VectorXd& load) {
  for (std::uint32_t e = s.begin[index]; e < s.begin[index + 1]; ++e) {
    load.segment<3>(3 * s.nodes[e]) += s.weights[e] * sigma;
  }
}

// Mass, ether, gravity and drag of each node. The drag tensor is symmetric: `d` has its six numbers, row by row.
void add_nodes(const PlainLevel& level, const PlainInput& input, const NodeVectors& P, const NodeVectors& P_dot,
               BaselineSystem& system) {
  const double h = input.step_s;
  const Matrix3d R = rotation(input.head_to);
  const Vector3d gravity_load = vector_at(input.gravity) - R * vector_at(input.design_gravity);
  for (std::size_t i = 0; i < level.node_count; ++i) {
    const auto c = static_cast<Eigen::Index>(i);
    const double m = level.mass[i], k = level.ether_stiffness[i], q = level.ether_damping[i];
    const double* d = level.drag + 6 * i;
    Matrix3d Q;
    Q << d[0], d[1], d[2], d[1], d[3], d[4], d[2], d[4], d[5];
    Q = (R * Q * R.transpose()).eval();
    const Vector3d f = -k * (P.col(c) - system.rest.col(c)) - q * (P_dot.col(c) - system.rest_dot.col(c)) +
                       m * gravity_load - Q * P_dot.col(c);
    system.load.segment<3>(3 * c) = h * (f - h * k * P_dot.col(c));
    system.node_blocks[i] = (m + h * q + h * h * k) * Matrix3d::Identity() + h * Q;
  }
}

// This is the law of core/solver/spring.hpp, written again with its constants: this library, which is compiled for the
// building machine, includes nothing of core. The lower bound of q, -h k / 3, is that of core/solver/damping.hpp.
constexpr double kStiffStrain = 0.02, kStiffening = 2, kBucklingStrain = 0.05, kBuckling = 0.9;

void add_springs(const PlainLevel& level, double h, const NodeVectors& P, const NodeVectors& P_dot,
                 BaselineSystem& system) {
  const PlainStiffeners& springs = level.springs;
  for (std::size_t s = 0; s < springs.count; ++s) {
    const Vector3d eps = weighted_sum(springs, s, P), eps_dot = weighted_sum(springs, s, P_dot);
    const double length = eps.norm(), rest_length = springs.rest_length[s], x = length - rest_length;
    if (!(length > 0)) continue;
    const Vector3d e = eps / length;
    const double stiff_m = kStiffStrain * rest_length, buckling_m = kBucklingStrain * rest_length;
    const double change = x > stiff_m ? kStiffening : x < -buckling_m ? -kBuckling : 0;
    const double beyond = change > 0 ? x - stiff_m : x + buckling_m;
    const double k = springs.stiffness[s] * (1 + change), tension = springs.stiffness[s] * (x + change * beyond);
    const double q = std::max(springs.damping[s] - h * k, -h * k / 3);
    const double sigma = -tension - (q + h * k) * e.dot(eps_dot);
    scatter(springs, s, h * sigma * e, system.load);
    system.springs.push_back({&springs, s, (h * q + h * h * k) * e * e.transpose()});
  }
}

// Attachments (eq. 4) pull to the rigid shape, which moves with the head.
void add_attachments(const PlainLevel& level, double h, const NodeVectors& P, const NodeVectors& P_dot,
                     BaselineSystem& system) {
  const PlainStiffeners& attachments = level.attachments;
  for (std::size_t s = 0; s < attachments.count; ++s) {
    const double k = attachments.stiffness[s], q = attachments.damping[s];
    const Vector3d eps = weighted_sum(attachments, s, P), eps_dot = weighted_sum(attachments, s, P_dot);
    const Vector3d sigma = -k * (eps - weighted_sum(attachments, s, system.rest)) -
                           q * (eps_dot - weighted_sum(attachments, s, system.rest_dot)) - h * k * eps_dot;
    scatter(attachments, s, h * sigma, system.load);
    system.attachments.push_back({&attachments, s, (h * q + h * h * k) * Matrix3d::Identity()});
  }
}

// Interpolates like skin_distance() of core/skin/skin_distance_field.hpp, written again in plain numbers.
double skin_distance(const PlainSkinDistanceField& field, const Vector3d& point, Vector3d* gradient = nullptr) {
  const Vector3d at = (point - vector_at(field.origin)) / field.cell_m;
  Vector3d within, t;
  int low[3];
  for (int a = 0; a < 3; ++a) {
    within[a] = std::clamp(at[a], 0.0, field.dims[a] - 1.0);
    low[a] = std::min(static_cast<int>(within[a]), field.dims[a] - 2);
    t[a] = within[a] - low[a];
  }
  double value = 0;
  Vector3d slope = Vector3d::Zero();
  for (int c = 0; c < 8; ++c) {
    const int up[3] = {c & 1, c >> 1 & 1, c >> 2};
    double share[3], sign[3];
    for (int a = 0; a < 3; ++a) {
      share[a] = up[a] ? t[a] : 1 - t[a];
      sign[a] = up[a] ? 1 : -1;
    }
    const double d = static_cast<double>(
        field.distance[low[0] + up[0] + field.dims[0] * (low[1] + up[1] + field.dims[1] * (low[2] + up[2]))]);
    value += share[0] * share[1] * share[2] * d;
    slope += d * Vector3d(sign[0] * share[1] * share[2], share[0] * sign[1] * share[2], share[0] * share[1] * sign[2]);
  }
  if (gradient) *gradient = slope / field.cell_m;
  return value + field.cell_m * (at - within).norm();
}

// This is the law of core/solver/contact.hpp, written again with its constants and those of core/levels/level.hpp.
constexpr double kContactDepth_m = 0.05, kContactStiffnessDepth_m = 0.01, kContactRecovery_m_per_s = 0.4;
constexpr double kContactNever_m = -1;

void add_contacts(const PlainLevel& level, const PlainInput& input, const NodeVectors& P, const NodeVectors& P_dot,
                  BaselineSystem& system) {
  // `h` is the length of the step.
  const double h = input.step_s, slope_of_u = 6 / (kContactDepth_m * kContactDepth_m * kContactDepth_m);
  const PlainContactPoints& points = level.contacts;
  for (std::size_t p = 0; p < points.count; ++p) {
    Vector3d displacement = Vector3d::Zero(), velocity = Vector3d::Zero();
    double weight_sum = 0;
    for (std::uint32_t e = points.begin[p]; e < points.begin[p + 1]; ++e) {
      const auto c = static_cast<Eigen::Index>(points.nodes[e]);
      const double weight = static_cast<double>(points.weights[e]);
      displacement += weight * (P.col(c) - point(input.head_from, vector_at(level.rest, points.nodes[e])));
      velocity += weight * (P_dot.col(c) - system.rest_dot.col(c));
      weight_sum += weight;
    }
    const Vector3d rest = Eigen::Map<const Eigen::Vector3f>(points.rest + 3 * p).cast<double>();
    const Vector3d from = point(input.head_from, rest) + displacement,
                   with_head = point(input.head_to, rest) + displacement;
    for (std::size_t f = 0; f < level.skin_count; ++f) {
      const PlainSkinDistanceField& field = level.skin[f];
      const PlainBone& bone = input.bones[f];
      const double limit = static_cast<double>(field.limit[p]);
      // The point cannot reach this skin.
      if (limit <= kContactNever_m) continue;
      const Vector3d at = point(bone.to_rest_before, from);
      const Vector3d travel = point(bone.to_rest, with_head + h * velocity) - at;
      Vector3d gradient;
      const double depth = limit - skin_distance(field, at, &gradient);
      const Vector3d normal = gradient / std::max(gradient.norm(), 1e-6);
      const double ahead = depth - normal.dot(travel);
      const bool comes_in =
          ahead > 0 && std::min(skin_distance(field, at + travel / 2), skin_distance(field, at + travel)) < limit;
      if (!(depth > 0) && !comes_in) continue;
      const double slope = (1 - input.contact_release) * slope_of_u * static_cast<double>(points.potential[p]);
      const double k = slope * std::clamp(std::max(depth, ahead), 0.0, kContactStiffnessDepth_m);
      const double push = depth > 0 ? std::min(slope * depth * depth / 2, k * kContactRecovery_m_per_s * h) : k * depth;
      const Vector3d outward = rotation(bone.from_rest) * normal;
      const double force = push - k * normal.dot(point(bone.to_rest, with_head) - at);
      for (std::uint32_t e = points.begin[p]; e < points.begin[p + 1]; ++e) {
        const auto c = static_cast<Eigen::Index>(points.nodes[e]);
        const double weight = static_cast<double>(points.weights[e]), node_k = weight * weight_sum * k;
        const double along = h * outward.dot(P_dot.col(c) - system.rest_dot.col(c));
        system.load.segment<3>(3 * c) += h * (weight * force - node_k * along) * outward;
        system.node_blocks[points.nodes[e]] += h * h * node_k * outward * outward.transpose();
      }
    }
  }
}

}  // namespace

void compute_system(const PlainLevel& level, const PlainInput& input, const NodeVectors& P, const NodeVectors& P_dot,
                    BaselineSystem& system) {
  const auto n = static_cast<Eigen::Index>(level.node_count);
  system.rest.resize(3, n);
  system.rest_dot.resize(3, n);
  system.load.resize(3 * n);
  system.node_blocks.resize(level.node_count);
  system.springs.clear();
  system.attachments.clear();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3d rest = vector_at(level.rest, static_cast<std::size_t>(i));
    system.rest.col(i) = point(input.head_to, rest);
    system.rest_dot.col(i) = (system.rest.col(i) - point(input.head_from, rest)) / input.step_s;
  }
  add_nodes(level, input, P, P_dot, system);
  add_springs(level, input.step_s, P, P_dot, system);
  add_attachments(level, input.step_s, P, P_dot, system);
  add_contacts(level, input, P, P_dot, system);
}

bool advance(double step_s, const Eigen::VectorXd& dP_dot, NodeVectors& P, NodeVectors& P_dot) {
  if (!dP_dot.allFinite()) return false;
  P_dot.reshaped() += dP_dot;
  P += step_s * P_dot;
  return true;
}

}  // namespace hairnet::bench
