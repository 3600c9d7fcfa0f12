#include "core/ffd/lattice.hpp"

#include "core/assert.hpp"

namespace hairnet {
namespace {

// The most nodes an axis, since a lattice may come from a peer. The limit keeps indices far within 32 bits and bounds
// the memory of a grid. It equals kLatticeNodesPerAxisMax of schema/limits.hpp.
constexpr int kNodesPerAxisMax = 64;

std::string validate_lattice(const Lattice& lattice) {
  for (const int n : lattice.dims) {
    if (n < 2 || n > kNodesPerAxisMax) return "lattice: nodes an axis not in [2, 64]";
  }
  if (!lattice.origin.allFinite()) return "lattice: origin not finite";
  if (!lattice.spacing.allFinite() || !(lattice.spacing.minCoeff() > 0))
    return "lattice: spacing not finite and positive";
  return {};
}

// Whether active and trimmed nodes both ascend, and each grid node is in exactly one of the two lists.
bool is_partition(const LevelGeometry& geometry) {
  std::size_t a = 0, t = 0;
  const std::size_t node_count = geometry.lattice.node_count();
  if (geometry.active_nodes.size() + geometry.trimmed_nodes.size() != node_count) return false;
  for (std::uint32_t node = 0; node < node_count; ++node) {
    if (a < geometry.active_nodes.size() && geometry.active_nodes[a] == node) {
      ++a;
    } else if (t < geometry.trimmed_nodes.size() && geometry.trimmed_nodes[t] == node) {
      ++t;
    } else {
      return false;
    }
  }
  return true;
}

}  // namespace

void expand_displacements(const LevelGeometry& geometry, std::span<const Vec3f> active, std::span<Vec3f> grid_out) {
  HAIRNET_ASSERT(active.size() == geometry.active_nodes.size());
  HAIRNET_ASSERT(grid_out.size() == geometry.lattice.node_count());
  HAIRNET_ASSERT(geometry.active_nodes.size() + geometry.trimmed_nodes.size() == grid_out.size());
  HAIRNET_ASSERT(geometry.trimmed_nodes.empty() || geometry.trimmed_begin.size() == geometry.trimmed_nodes.size() + 1);
  HAIRNET_ASSERT(geometry.trimmed_from.size() == geometry.trimmed_weights.size());
  HAIRNET_VALIDATE(is_partition(geometry));
  for (std::size_t a = 0; a < active.size(); ++a) grid_out[geometry.active_nodes[a]] = active[a];
  for (std::size_t t = 0; t < geometry.trimmed_nodes.size(); ++t) {
    Vec3f sum = Vec3f::Zero();
    for (std::uint32_t e = geometry.trimmed_begin[t]; e < geometry.trimmed_begin[t + 1]; ++e) {
      sum += geometry.trimmed_weights[e] * active[geometry.trimmed_from[e]];
    }
    grid_out[geometry.trimmed_nodes[t]] = sum;
  }
}

std::string validate(const LevelGeometry& geometry) {
  if (std::string error = validate_lattice(geometry.lattice); !error.empty()) return error;
  if (!is_partition(geometry)) return "active and trimmed nodes are not the whole grid, each once and ascending";
  const auto& begin = geometry.trimmed_begin;
  if (begin.size() != geometry.trimmed_nodes.size() + 1 || begin.front() != 0 ||
      begin.back() != geometry.trimmed_from.size() || geometry.trimmed_weights.size() != geometry.trimmed_from.size())
    return "trimmed nodes: counts disagree";
  for (std::size_t t = 0; t + 1 < begin.size(); ++t) {
    if (begin[t] > begin[t + 1]) return "trimmed nodes: offsets descend";
  }
  for (std::size_t e = 0; e < geometry.trimmed_from.size(); ++e) {
    if (geometry.trimmed_from[e] >= geometry.active_nodes.size()) return "trimmed nodes: an active node does not exist";
    // The sizes of a built node's weights sum to at most kAmplificationMax = 3. Larger weights would throw the hair of
    // a valid frame across the room.
    if (!(geometry.trimmed_weights[e] >= -16 && geometry.trimmed_weights[e] <= 16))
      return "trimmed nodes: a weight is not in [-16, 16]";
  }
  return {};
}

}  // namespace hairnet
