#pragma once

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "core/levels/level.hpp"
#include "core/skin/skin_distance_field.hpp"
#include "core/solver/step.hpp"

// Small levels put together by hand, for tests that are about the solver and not about hair.
namespace hairnet::support {

inline Vec3f random_vec(std::mt19937& random, float size) {
  std::uniform_real_distribution<float> range(-size, size);
  const float x = range(random), y = range(random), z = range(random);
  return {x, y, z};
}

// Returns the trilinear weights of a point inside the lattice, over all eight corners of its cell.
inline std::vector<std::pair<std::uint32_t, float>> trilinear(const Lattice& lattice, const Vec3f& x) {
  const Vec3f g = (x - lattice.origin).cwiseQuotient(lattice.spacing);
  const Eigen::Array3i cell = g.array().floor().cast<int>();
  std::vector<std::pair<std::uint32_t, float>> weights;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i offset(corner & 1, corner >> 1 & 1, corner >> 2);
    float w = 1;
    for (int a = 0; a < 3; ++a) {
      const float t = g[a] - static_cast<float>(cell[a]);
      w *= offset[a] ? t : 1 - t;
    }
    const Eigen::Array3i at = cell + offset;
    weights.emplace_back(lattice.index(at[0], at[1], at[2]), w);
  }
  return weights;
}

// Adds a stiffener from weights of grid nodes. Every node of the grid is active here; weights of one node are summed,
// and nodes come in ascending order.
inline void add_stiffener(const Level& level, Stiffeners& stiffeners,
                          const std::vector<std::pair<std::uint32_t, float>>& weights, float k, float q) {
  std::vector<float> by_node(level.rest.size(), 0.0f);
  for (const auto& [node, w] : weights) by_node[node] += w;
  Vec3f rest = Vec3f::Zero();
  for (std::uint32_t node = 0; node < by_node.size(); ++node) {
    if (by_node[node] == 0) continue;
    stiffeners.nodes.push_back(static_cast<std::uint16_t>(node));
    stiffeners.weights.push_back(by_node[node]);
    rest += by_node[node] * level.rest[node];
  }
  stiffeners.begin.push_back(static_cast<std::uint32_t>(stiffeners.nodes.size()));
  stiffeners.stiffness.push_back(k);
  stiffeners.damping.push_back(q);
  stiffeners.rest.push_back(rest);
}

// Makes the field of signed distances to a sphere, in a cube of 30 cm about its centre.
inline SkinDistanceField make_round_skin(Bone bone, const Vec3f& centre, float radius_m, int nodes_per_axis = 31) {
  const float cell_m = 0.3f / static_cast<float>(nodes_per_axis - 1);
  SkinDistanceField field{
      bone, centre - Vec3f::Constant(0.15f), cell_m, {nodes_per_axis, nodes_per_axis, nodes_per_axis}, {}};
  for (int k = 0; k < nodes_per_axis; ++k) {
    for (int j = 0; j < nodes_per_axis; ++j) {
      for (int i = 0; i < nodes_per_axis; ++i) {
        const Vec3f at =
            field.origin + cell_m * Vec3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k));
        field.distance.push_back((at - centre).norm() - radius_m);
      }
    }
  }
  return field;
}

// Adds a contact point, which moves with the eight nodes of its cell by trilinear weights.
inline void add_contact(Level& level, const Vec3f& rest, float potential_j = 0.03f) {
  ContactPoints& contacts = level.contacts;
  auto weights = trilinear(level.geometry.lattice, rest);
  std::ranges::sort(weights);
  for (const auto& [node, w] : weights) {
    if (!(w > 0)) continue;
    contacts.nodes.push_back(static_cast<std::uint16_t>(node));
    contacts.weights.push_back(w);
  }
  contacts.begin.push_back(static_cast<std::uint32_t>(contacts.nodes.size()));
  contacts.rest.push_back(rest);
  contacts.potential.push_back(potential_j);
}

// Sets how near to each skin each contact point may come: 6 mm, or as near as it is in the design (less 10 um, so that
// rounding makes no contact there). Call it when all points have been added.
inline void set_limits(Level& level) {
  ContactPoints& contacts = level.contacts;
  for (const SkinDistanceField& field : *level.skin) {
    for (const Vec3f& rest : contacts.rest) {
      contacts.limit.push_back(std::min(0.006f, static_cast<float>(skin_distance(field, rest.cast<double>())) - 1e-5f));
    }
  }
}

// Describes a random level: sizes, stiffness in N/m, and which parts it has. The seed chooses all random numbers.
struct RandomLevel {
  int nodes_per_axis = 4;
  int spring_count = 60, attachment_count = 10;
  float spring_stiffness = 2, attachment_stiffness = 5;
  bool ether = true, drag = true, contacts = true;
  int contact_count = 20, skin_nodes_per_axis = 31;
  unsigned seed = 1;
};

// Makes a level on a cube of nodes with sides of 24 cm about the head joint. Springs, attachments and contact points
// are at random places; the skin is a ball of 8 cm radius on the head and another on the left shoulder.
inline Level make_random_level(const RandomLevel& def = {}) {
  std::mt19937 random(def.seed);
  std::uniform_real_distribution<float> unit(0, 1);
  Level level;
  Lattice& lattice = level.geometry.lattice;
  lattice.dims = {def.nodes_per_axis, def.nodes_per_axis, def.nodes_per_axis};
  lattice.spacing = Vec3f::Constant(0.24f / static_cast<float>(def.nodes_per_axis - 1));
  lattice.origin = Vec3f(-0.12f, -0.16f, -0.12f);
  level.geometry.trimmed_begin = {0};
  for (std::uint32_t node = 0; node < lattice.node_count(); ++node) {
    level.geometry.active_nodes.push_back(node);
    level.rest.push_back(lattice.node(node));
    // Each node has 0.2 to 0.6 g. The ether holds it with 40 N/m for each kilogram, like gravity holds a pendulum of 25
    // cm. Its damping time is 60 ms.
    const float mass = 2e-4f + 4e-4f * unit(random);
    level.mass.push_back(mass);
    const float ether = def.ether ? 40 * mass : 0;
    level.ether_stiffness.push_back(ether);
    level.ether_damping.push_back(0.06f * ether);
    const Vec3f e = random_vec(random, 1).normalized();
    const Mat3f Q = (def.drag ? 2e-3f : 0.0f) * (Mat3f::Identity() - e * e.transpose());
    level.drag.push_back({Q(0, 0), Q(0, 1), Q(0, 2), Q(1, 1), Q(1, 2), Q(2, 2)});
  }
  const auto random_point = [&] { return Vec3f(lattice.origin + Vec3f::Constant(0.12f) + random_vec(random, 0.119f)); };
  // A spring leads from one random point 0.3 of the way to another one. Its damping time is 8 ms, that of an attachment
  // 10 ms.
  for (int s = 0; s < def.spring_count; ++s) {
    const Vec3f from = random_point(), to = from + 0.3f * (random_point() - from);
    auto weights = trilinear(lattice, to);
    for (auto [node, w] : trilinear(lattice, from)) weights.emplace_back(node, -w);
    const float k = def.spring_stiffness * (0.5f + unit(random));
    add_stiffener(level, level.springs, weights, k, 0.008f * k);
  }
  for (int s = 0; s < def.attachment_count; ++s) {
    const float k = def.attachment_stiffness * (0.5f + unit(random));
    add_stiffener(level, level.attachments, trilinear(lattice, random_point()), k, 0.01f * k);
  }
  if (def.contacts) {
    level.skin = std::make_shared<Skin>(
        Skin{make_round_skin(Bone::head, Vec3f(0, 0, 0), 0.08f, def.skin_nodes_per_axis),
             make_round_skin(Bone::left_shoulder, Vec3f(0.1f, -0.2f, 0), 0.08f, def.skin_nodes_per_axis)});
    for (int p = 0; p < def.contact_count; ++p) {
      add_contact(level, random_point());
    }
    set_limits(level);
  }
  return level;
}

// Makes a state in which each coordinate of each node is displaced by up to `displacement_m`, and moves at up to
// `velocity_m_per_s`, both at random.
inline LatticeState make_random_state(const Level& level, float displacement_m, float velocity_m_per_s, unsigned seed) {
  std::mt19937 random(seed);
  LatticeState state;
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    state.displacement.push_back(random_vec(random, displacement_m));
    state.velocity.push_back(random_vec(random, velocity_m_per_s));
  }
  return state;
}

// Returns the turn by an angle about an axis through the origin, and then the shift to `position`.
inline RigidTransform turned(double angle_rad, const Vec3& axis, const Vec3& position = Vec3::Zero()) {
  return {Quat(Eigen::AngleAxisd(angle_rad, axis.normalized())), position};
}

}  // namespace hairnet::support
