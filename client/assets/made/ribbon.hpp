#pragma once

#include <functional>

#include "client/assets/made/style.hpp"

namespace hairnet::made {

// A grid of cloth, `columns` x `rows` points; `at(column, row)` is in head space, m. It may be closed in a ring along
// the columns. The caller sets the distances of pinned points.
struct ClothGrid {
  int columns = 2, rows = 2;
  bool ring = false;
  std::function<Vec3(int column, int row)> at;
};
// Adds the cloth, at least `clearance_m` from the skin, with the given properties. Returns the index of its first
// point, row by row.
std::uint32_t add_cloth_grid(Groom& groom, const ClothGrid& grid, double clearance_m, Cloth cloth);

// A bow of satin ribbon: two loops and two ends, tied at `centre`. `out` points away from the head there. Returns the
// points at its knot. It is made of five pieces of cloth, which hang together only by the knot that the caller makes of
// the points.
std::vector<std::uint32_t> add_bow(Groom& groom, const Vec3& centre, const Vec3& out, const Vec3f& colour);

}  // namespace hairnet::made
