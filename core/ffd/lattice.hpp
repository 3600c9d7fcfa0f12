#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/assert.hpp"
#include "core/geometry/vec.hpp"

namespace hairnet {

// A regular grid of nodes in head space. Node (i, j, k) has grid index i + nx (j + ny k) and lies at
// origin + (i dx, j dy, k dz).
struct Lattice {
  Vec3f origin = Vec3f::Zero();  // m
  // The distance between neighbouring nodes along each axis, m, each > 0.
  Vec3f spacing = Vec3f::Ones();
  // The number of nodes along each axis, each >= 2; quadratic FFD needs >= 3.
  std::array<int, 3> dims{0, 0, 0};

  [[nodiscard]] std::size_t node_count() const {
    return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(dims[2]);
  }
  [[nodiscard]] std::uint32_t index(int i, int j, int k) const {
    HAIRNET_VALIDATE(0 <= i && i < dims[0] && 0 <= j && j < dims[1] && 0 <= k && k < dims[2]);
    return static_cast<std::uint32_t>(i + dims[0] * (j + dims[1] * k));
  }
  [[nodiscard]] std::array<int, 3> coordinates(std::uint32_t node) const {
    HAIRNET_VALIDATE(node < node_count());
    const int n = static_cast<int>(node);
    return {n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])};
  }
  [[nodiscard]] Vec3f node(std::uint32_t node) const {
    const auto [i, j, k] = coordinates(node);
    return origin + Vec3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)).cwiseProduct(spacing);
  }
};

// Which grid nodes of a level are simulated ("active") and how the other nodes follow them. Immutable; sent to clients.
// All data of active nodes is in the order of `active_nodes`; an "active index" is an index into that list. Both ends
// expand the same lists, so server and clients move the same hair.
struct LevelGeometry {
  Lattice lattice;
  // The grid indices of the active nodes, ascending.
  std::vector<std::uint32_t> active_nodes;
  // The grid indices of all other nodes, ascending.
  std::vector<std::uint32_t> trimmed_nodes;
  // Trimmed node t follows the entries [trimmed_begin[t], trimmed_begin[t + 1]) of the two lists below: its
  // displacement is the sum of weight * displacement(from).
  std::vector<std::uint32_t> trimmed_begin;
  // The active index of the node that is followed.
  std::vector<std::uint32_t> trimmed_from;
  // The weight with which it is followed.
  std::vector<float> trimmed_weights;
};

// Displacements (head space, m) of every grid node, in index order, from those of the active nodes.
void expand_displacements(const LevelGeometry& geometry, std::span<const Vec3f> active, std::span<Vec3f> grid_out);

// Returns an empty string when valid (dims and counts agree, indices are in range and ascending, numbers finite); else
// one line.
std::string validate(const LevelGeometry& geometry);

}  // namespace hairnet
