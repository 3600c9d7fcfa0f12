#pragma once

#include <cstddef>
#include <optional>

#include "client/draw/draw_detail.hpp"
#include "core/modes/moved_lattice.hpp"

namespace hairnet::draw {

// Where a character's grid of density lies: a box that contains its hair as it is now and at rest, and in which the GPU
// counts strands to follow light through moved hair (client/shaders/density.glsl). The processor computes only this
// box. Head space, m.
struct DensityGrid {
  // Cells an axis. The shaders have the same number (kDensitySide).
  static constexpr std::size_t kDensitySide = 32;
  // A picture has no more grids, which bounds the memory of the GPU; further characters keep the resting light.
  static constexpr std::size_t kDensityGridsMax = 16;
  // No more strands of a character are counted; each then stands for several, so the sum is about the same.
  static constexpr std::size_t kDensityStrandsMax = 1500;

  // The number of the grid in its picture, from 0. A character's record has it plus 1, since 0 in a record means no
  // grid.
  std::size_t number = 0;
  // The corner, and the size of a cell, which may differ between axes.
  Vec3f origin, cell;
  // The optical depth in a metre of a cell that contains a metre of strand.
  float weight = 0;
};

// A box that contains the hair as the lattice moves it. `rest` contains the resting hair, `roots` the points that do
// not move. The box is wider than needed: it moves the nearest resting place by each node near the hair, which takes a
// moment, instead of all points by FFD.
Eigen::AlignedBox3f moved_box(const Eigen::AlignedBox3f& rest, const Eigen::AlignedBox3f& roots,
                              const MovedLattice& moved);

// Lays a grid over the box. `width_m` is the width of all strands together that one counted strand represents.
DensityGrid density_grid(const Eigen::AlignedBox3f& box, std::size_t number, float width_m);

// A groom's strands at rest.
struct RestingStrands {
  // These boxes contain all points, and the roots. Head space, m. `roots` is the part of `box` that stays with the
  // skin.
  Eigen::AlignedBox3f box, roots;
  // The width of each strand at its root when all are drawn.
  float width_m = 0;
  std::size_t count = 0;
};
// Returns the grid with that number in its picture; none for a character that is too small (FFD is linear only), that
// is one too many, or whose hair has no strands. The weight fades in with the size on the screen, so that light does
// not jump.
std::optional<DensityGrid> density_of(const RestingStrands& strands, const DrawDetail& detail,
                                      const MovedLattice& lattice, std::size_t number);

}  // namespace hairnet::draw
