#include "tests/bench/baseline_forces.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet::bench {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

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

void add_springs(const PlainLevel& level, double h, const NodeVectors& P, const NodeVectors& P_dot,
                 BaselineSystem& system) {
  const PlainStiffeners& springs = level.springs;
  for (std::size_t s = 0; s < springs.count; ++s) {
    const Vector3d eps = weighted_sum(springs, s, P), eps_dot = weighted_sum(springs, s, P_dot);
    const double length = eps.norm(), k = springs.stiffness[s], q = springs.damping[s];
    if (!(length > 0)) continue;
    const Vector3d e = eps / length;
    const double sigma = -k * (length - springs.rest_length[s]) - (q + h * k) * e.dot(eps_dot);
    scatter(springs, s, h * sigma * e, system.load);
    system.springs.push_back({&springs, s, (h * q + h * h * k) * e * e.transpose()});
  }
}

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

// metaball.hpp and contact.hpp say what this is.
void add_contacts(const PlainLevel& level, const PlainInput& input, const NodeVectors& P, const NodeVectors& P_dot,
                  BaselineSystem& system) {
  const double h = input.step_s;
  for (std::size_t b = 0; b < level.ball_count; ++b) {
    const PlainBall& ball = input.balls[b];
    for (std::size_t i = 0; i < level.node_count; ++i) {
      const double rho = level.ball_radius[b * level.node_count + i];
      if (!(rho > 0)) continue;
      const auto c = static_cast<Eigen::Index>(i);
      const Vector3d with_bone = point(ball.carry, P.col(c));
      const Vector3d r = with_bone - vector_at(ball.centre);
      const double u = r.squaredNorm() / (rho * rho);
      if (!(u < 1) || !(u > 0)) continue;
      const Vector3d outward = r.normalized();
      const double U = (1 - input.contact_release) * level.ball_potential[b * level.node_count + i];
      const double slope = 6 * U / (rho * rho) * (1 - u);
      const double k = slope * std::max(5 * u - 1, u + std::sqrt(u));
      const Vector3d otherwise = P.col(c) - with_bone + h * P_dot.col(c);
      system.load.segment<3>(3 * c) += h * (slope * (1 - u) * r - k * outward.dot(otherwise) * outward);
      system.node_blocks[i] += h * h * k * outward * outward.transpose();
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
