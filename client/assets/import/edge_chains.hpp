#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hairnet {

// Polylines of vertices.
struct Chains {
  std::vector<std::uint32_t> vertices;
  // Chain c has those from begin[c] to before begin[c + 1].
  std::vector<std::size_t> begin{0};
  // The group of each chain is known by this edge.
  std::vector<std::uint32_t> first_edge;
  [[nodiscard]] std::size_t count() const { return begin.size() - 1; }
};

// Joins edges, in whatever order and direction, that end at the same vertex: always two of them, in their order, so
// that where more meet, other chains begin. A chain begins at the end of the lower number, since programs number the
// points of a strand from one end to the other. All vertices are less than `vertex_count`. Where three strands meet in
// a vertex, the third chain ends there. Time and memory are linear in edges and vertices.
Chains chain_edges(std::span<const std::array<std::uint32_t, 2>> edges, std::size_t vertex_count);

}  // namespace hairnet
