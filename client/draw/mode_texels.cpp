#include "client/draw/mode_texels.hpp"

namespace hairnet::draw {

std::size_t node_rows(const LevelGeometry& geometry) {
  return (geometry.lattice.node_count() + kLatticeRow - 1) / kLatticeRow;
}

std::size_t mode_rows(const LevelGeometry& geometry, const Basis& basis) {
  // Whole groups of four, since the shader reads four modes for each texel of coefficients.
  return (basis.mode_count() + 3) / 4 * 4 * node_rows(geometry);
}

std::vector<Eigen::Vector4f> mode_texels(const LevelGeometry& geometry, const Basis& basis) {
  const std::size_t row = kLatticeRow * node_rows(geometry);
  std::vector<Vec3f> active(basis.node_count), grid(geometry.lattice.node_count());
  std::vector<Eigen::Vector4f> texels(kLatticeRow * mode_rows(geometry, basis), Eigen::Vector4f::Zero());
  std::vector<float> coefficients;
  for (std::size_t mode = 0; mode < basis.mode_count(); ++mode) {
    // The displacement that a single coefficient of 1 makes is the mode itself.
    coefficients.assign(mode + 1, 0);
    coefficients.back() = 1;
    displacements_of(basis, coefficients, active);
    // This works out the trimmed nodes, which are fixed sums of active ones.
    expand_displacements(geometry, active, grid);
    for (std::size_t node = 0; node < grid.size(); ++node) texels[row * mode + node].head<3>() = grid[node];
  }
  return texels;
}

}  // namespace hairnet::draw
