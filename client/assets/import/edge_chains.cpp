#include "client/assets/import/edge_chains.hpp"

#include <algorithm>
#include <limits>

namespace hairnet {

// The two ends of edge e are 2 e and 2 e + 1.
Chains chain_edges(std::span<const std::array<std::uint32_t, 2>> edges, std::size_t vertex_count) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  const auto vertex = [&](std::size_t end) { return edges[end / 2][end % 2]; };
  // `waiting` holds at each vertex the end that has no partner yet. The second end that comes pairs with it, and
  // empties the place for a third.
  std::vector<std::size_t> mate(2 * edges.size(), kNone), waiting(vertex_count, kNone);
  for (std::size_t end = 0; end < mate.size(); ++end) {
    std::size_t& other = waiting[vertex(end)];
    // An edge from a vertex to itself must not pair with itself, which would end its chain in a loop.
    if (other == kNone || other / 2 == end / 2) {
      other = end;
      continue;
    }
    mate[end] = other;
    mate[other] = end;
    other = kNone;
  }
  Chains chains;
  std::vector<bool> is_done(edges.size(), false);
  // Walks from one free end to the other: out of an edge by its far end, into the edge that is paired there.
  const auto follow = [&](std::size_t end) {
    chains.first_edge.push_back(static_cast<std::uint32_t>(end / 2));
    chains.vertices.push_back(vertex(end));
    while (end != kNone && !is_done[end / 2]) {
      is_done[end / 2] = true;
      const std::size_t far = end ^ 1U;
      chains.vertices.push_back(vertex(far));
      end = mate[far];
    }
    const auto first = chains.vertices.begin() + static_cast<std::ptrdiff_t>(chains.begin.back());
    if (chains.vertices.back() < *first) std::reverse(first, chains.vertices.end());
    chains.begin.push_back(chains.vertices.size());
  };
  // Open chains come first, from their free ends. What remains then consists of rings, which may begin anywhere.
  for (std::size_t end = 0; end < mate.size(); ++end) {
    if (mate[end] == kNone && !is_done[end / 2]) follow(end);
  }
  for (std::size_t end = 0; end < mate.size(); end += 2) {
    if (!is_done[end / 2]) follow(end);  // a ring
  }
  return chains;
}

}  // namespace hairnet
