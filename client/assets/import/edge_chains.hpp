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
  // An edge of each chain, by which the caller finds the chain's group.
  std::vector<std::uint32_t> first_edge;
  [[nodiscard]] std::size_t count() const { return begin.size() - 1; }
};

// Joins edges, given in any order and direction, to chains. At a vertex the first two edge ends of the list are joined,
// then the third and the fourth, and so on; an end that remains alone ends its chain there. So where three strands
// meet, the third one is a chain of its own.
// A chain begins at the end with the lower number, since programs number the points of a strand from one end to the
// other. All vertices are less than `vertex_count`. Time and memory are linear in edges and vertices.
Chains chain_edges(std::span<const std::array<std::uint32_t, 2>> edges, std::size_t vertex_count);

}  // namespace hairnet
