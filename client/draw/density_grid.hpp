#pragma once

#include <cstddef>
#include <optional>

#include "client/draw/draw_detail.hpp"
#include "core/modes/moved_lattice.hpp"

namespace hairnet::draw {

// Where a character's grid of density lies (client/shaders/density.glsl). Head space, m.
struct DensityGrid {
  static constexpr std::size_t kDensitySide = 32;  // cells an axis
  // A picture has no more grids; further characters keep the resting light.
  static constexpr std::size_t kDensityGridsMax = 16;
  // No more strands of a character are counted, for all it has.
  static constexpr std::size_t kDensityStrandsMax = 1500;

  std::size_t number = 0;
  Vec3f origin, cell;
  // The optical depth in a metre of a cell that contains a metre of strand.
  float weight = 0;
};

// The box that contains the hair as the lattice moves it: `rest` contains the resting hair, `roots` what does not move.
Eigen::AlignedBox3f moved_box(const Eigen::AlignedBox3f& rest, const Eigen::AlignedBox3f& roots,
                              const MovedLattice& moved);

// `width_m`: of all strands together that one counted strand represents.
DensityGrid density_grid(const Eigen::AlignedBox3f& box, std::size_t number, float width_m);

// A groom's strands at rest.
struct RestingStrands {
  // They contain all points, and the roots.
  Eigen::AlignedBox3f box, roots;
  // Each strand is so wide.
  float width_m = 0;
  std::size_t count = 0;
};
// The next grid of a picture, `number`. None for characters that are too small, too many, or whose hair has no strands.
// The grid's weight fades in with size.
std::optional<DensityGrid> density_of(const RestingStrands& strands, const DrawDetail& detail,
                                      const MovedLattice& lattice, std::size_t number);

}  // namespace hairnet::draw
