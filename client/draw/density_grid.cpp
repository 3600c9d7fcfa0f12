#include "client/draw/density_grid.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include "client/draw/groom_geometry.hpp"
#include "client/draw/occlusion_grid.hpp"

namespace hairnet::draw {
namespace {

// This many cells at each side of the hair stay empty: a point adds to the cells around it, and light is sampled a
// little beside it.
constexpr float kCellsBeside = 1.5f;

}  // namespace

Eigen::AlignedBox3f moved_box(const Eigen::AlignedBox3f& rest, const Eigen::AlignedBox3f& roots,
                              const MovedLattice& moved) {
  if (moved.geometry == nullptr) return rest;
  const Lattice& lattice = moved.geometry->lattice;
  std::vector<Vec3f> scratch;
  const std::span<const Vec3f> nodes = nodes_of(moved, scratch);
  // Nodes further than a spacing from the hair are left out: they hardly move it.
  const Eigen::AlignedBox3f near(rest.min() - lattice.spacing, rest.max() + lattice.spacing);
  Eigen::AlignedBox3f box = roots;
  for (std::uint32_t n = 0; n < nodes.size(); ++n) {
    const Vec3f at = lattice.node(n);
    const Vec3f& moved_by = nodes[n];
    // The node is taken to the nearest place in the resting box, because its displacement moves hair there.
    if (near.contains(at) && moved_by.allFinite()) box.extend(at.cwiseMax(rest.min()).cwiseMin(rest.max()) + moved_by);
  }
  return box;
}

DensityGrid density_grid(const Eigen::AlignedBox3f& box, std::size_t number, float width_m) {
  DensityGrid grid;
  grid.number = number;
  const auto cells = static_cast<float>(DensityGrid::kDensitySide) - 2 * kCellsBeside;
  grid.cell = box.sizes() / cells;
  // A flat style would have cells thin as paper on one axis: no cell is thinner than a third of the longest side, or
  // than 1 mm.
  grid.cell = grid.cell.cwiseMax(std::max(grid.cell.maxCoeff() / 3, 1e-3f)).eval();
  grid.origin = box.center() - 0.5f * static_cast<float>(DensityGrid::kDensitySide) * grid.cell;
  // The optical depth is the width times the length of strands over the area of a cell. Dividing by the volume gives it
  // for a metre of the way. Share and taper are those of resting hair (OcclusionGrid), since only the difference
  // between moved and resting hair is drawn.
  grid.weight = kHairShare * kMeanTaper * width_m / grid.cell.prod();
  return grid;
}

std::optional<DensityGrid> density_of(const RestingStrands& strands, const DrawDetail& detail,
                                      const MovedLattice& lattice, std::size_t number) {
  // Without quadratic FFD a head is so small that moved light does not show.
  const std::size_t counted = std::min(drawn_strands(detail, strands.count), DensityGrid::kDensityStrandsMax);
  if (number >= DensityGrid::kDensityGridsMax || counted == 0 || !(detail.quadratic > 0)) return std::nullopt;
  const float width_m = strands.width_m * kCopies * static_cast<float>(strands.count) / static_cast<float>(counted);
  return density_grid(moved_box(strands.box, strands.roots, lattice), number, width_m * detail.quadratic);
}

}  // namespace hairnet::draw
